#include "bridge/carry/commands/drop_root.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace trestle::carry {
namespace {

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error{"--user: " + what};
}

}  // namespace

DropRoot::DropRoot(const std::string& user) : user_{user} {
  if (geteuid() != 0) {
    fail("only root can become " + user);
  }
  std::vector<char> room(65536);
  passwd entry{};
  passwd* found = nullptr;
  if (getpwnam_r(user.c_str(), &entry, room.data(), room.size(), &found) != 0 || found == nullptr) {
    fail("there is no user " + user);
  }
  uid_ = entry.pw_uid;
  gid_ = entry.pw_gid;
  if (uid_ == 0) {
    fail(user + " is root itself");
  }
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) {
    fail("no_new_privs: " + std::generic_category().message(errno));
  }
}

void DropRoot::give(const std::string& path) const {
  // In a folder that another user may write to it could be somebody else's by now: never through a link.
  if (::lchown(path.c_str(), uid_, gid_) != 0 && errno != ENOENT) {
    fail("cannot give " + path + " to " + user_ + ": " + std::generic_category().message(errno));
  }
}

void DropRoot::now() const {
  // The user last: only root may do the rest. The C library does each for all threads.
  if (initgroups(user_.c_str(), gid_) != 0 || setresgid(gid_, gid_, gid_) != 0 ||
      setresuid(uid_, uid_, uid_) != 0) {
    fail("cannot become " + user_ + ": " + std::generic_category().message(errno));
  }
  if (setuid(0) == 0 || getuid() != uid_ || geteuid() != uid_) {
    fail("could become root again");
  }
}

}  // namespace trestle::carry
