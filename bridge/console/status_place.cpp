#include "bridge/console/status_place.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <system_error>
#include <thread>

#include "someip/net/socket_calls.hpp"

namespace trestle::console {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

constexpr const char* system_folder = "/run/trestle";
constexpr const char* ending = ".sock";
constexpr const char* guest_ending = ".guests";
constexpr auto pause_while_full = std::chrono::milliseconds{20};

std::optional<fs::path> runtime_folder() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  return runtime != nullptr && *runtime == '/' ? std::optional{fs::path{runtime} / "trestle"} : std::nullopt;
}
fs::path own_temporary_folder() {
  return fmt::format("/tmp/trestle-{}", ::geteuid());
}

// Makes it if needed; then whether it is a folder of this user's that others cannot write to. In /tmp anybody
// may have made it before.
bool can_use(const fs::path& folder, mode_t mode) {
  if (::mkdir(folder.c_str(), mode) != 0 && errno != EEXIST) {
    return false;
  }
  struct stat there {};
  return ::lstat(folder.c_str(), &there) == 0 && S_ISDIR(there.st_mode) && there.st_uid == ::geteuid() &&
         (there.st_mode & (S_IWGRP | S_IWOTH)) == 0 && ::access(folder.c_str(), W_OK | X_OK) == 0;
}

// Folders of all users, for root.
void append_folders_of_all(std::vector<fs::path>& folders) {
  std::error_code error;
  for (const auto& user : fs::directory_iterator{"/run/user", error}) {
    folders.push_back(user.path() / "trestle");
  }
  for (const auto& one : fs::directory_iterator{"/tmp", error}) {
    if (one.path().filename().string().starts_with("trestle-")) {
      folders.push_back(one.path());
    }
  }
}

std::vector<fs::path> sockets_in(const std::vector<fs::path>& folders, const char* with_ending) {
  std::vector<fs::path> sockets;
  for (const fs::path& folder : folders) {
    std::error_code error;
    for (const auto& one : fs::directory_iterator{folder, error}) {
      if (one.path().extension() == with_ending && one.is_socket(error)) {
        sockets.push_back(one.path());
      }
    }
  }
  std::ranges::sort(sockets);
  return sockets;
}

}  // namespace

std::string socket_name(int pid) {
  return std::to_string(pid) + ending;
}

std::string guest_socket_name(int pid) {
  return std::to_string(pid) + guest_ending;
}

void remove_left_behind(const fs::path& socket) {
  for (const char* const one : {ending, guest_ending}) {
    ::unlink(fs::path{socket}.replace_extension(one).c_str());
  }
}

tl::expected<fs::path, std::string> status_folder() {
  std::vector<fs::path> tried;
  if (const auto runtime = runtime_folder()) {
    tried.push_back(*runtime);
    if (can_use(*runtime, 0700)) {
      return *runtime;
    }
  }
  if (can_use(system_folder, 0755)) {
    return fs::path{system_folder};
  }
  tried.emplace_back(system_folder);
  if (const fs::path own = own_temporary_folder(); can_use(own, 0700)) {
    return own;
  } else {
    tried.push_back(own);
  }
  std::string text;
  for (const fs::path& one : tried) {
    text += (text.empty() ? "" : ", ") + one.string();
  }
  return tl::unexpected{"none of these can be made and written to: " + text};
}

std::vector<fs::path> status_folders() {
  std::vector<fs::path> folders;
  if (const auto runtime = runtime_folder()) {
    folders.push_back(*runtime);
  }
  folders.emplace_back(system_folder);
  folders.push_back(own_temporary_folder());
  if (::geteuid() == 0) {
    append_folders_of_all(folders);
  }
  std::ranges::sort(folders);
  folders.erase(std::unique(folders.begin(), folders.end()), folders.end());
  return folders;
}

std::vector<fs::path> status_sockets(const std::vector<fs::path>& folders) {
  return sockets_in(folders, ending);
}

std::vector<fs::path> guest_sockets(const std::vector<fs::path>& folders) {
  return sockets_in(folders, guest_ending);
}

std::string told(AskError error, const fs::path& socket) {
  switch (error) {
    case AskError::gone:
      return {};
    case AskError::not_allowed:
      return socket.string() + ": a bridge of another user";
    case AskError::no_answer:
      break;
  }
  return socket.string() + ": the bridge does not answer; it may be stopped, or very busy";
}

tl::expected<int, AskError> connect_to(const fs::path& socket, std::chrono::milliseconds limit) {
  someip::Descriptor client{::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)};
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  const std::string path = socket.string();
  if (client.get() < 0 || path.size() >= sizeof address.sun_path) {
    return tl::unexpected{AskError::no_answer};
  }
  std::memcpy(static_cast<void*>(address.sun_path), path.data(), path.size());
  const auto end = steady_clock::now() + limit;
  while (::connect(client.get(), static_cast<sockaddr*>(static_cast<void*>(&address)), sizeof address) != 0) {
    if (errno == EAGAIN && steady_clock::now() < end) {
      std::this_thread::sleep_for(pause_while_full);
      continue;
    }
    if (errno == ECONNREFUSED) {
      remove_left_behind(socket);  // of a bridge that was killed
      return tl::unexpected{AskError::gone};
    }
    return tl::unexpected{errno == ENOENT                     ? AskError::gone
                          : errno == EACCES || errno == EPERM ? AskError::not_allowed
                                                              : AskError::no_answer};
  }
  return client.release();
}

tl::expected<std::string, AskError> ask(const fs::path& socket, std::chrono::milliseconds limit,
                                        std::size_t max_bytes) {
  const auto end = steady_clock::now() + limit;
  const auto connected = connect_to(socket, std::chrono::milliseconds{0});
  if (!connected) {
    return tl::unexpected{connected.error()};
  }
  const someip::Descriptor client{*connected};
  std::string answer;
  std::array<char, 65536> piece{};
  for (;;) {
    const ssize_t bytes = ::read(client.get(), piece.data(), piece.size());
    if (bytes == 0) {
      return answer;
    }
    if (bytes > 0) {
      answer.append(piece.data(), static_cast<std::size_t>(bytes));
      if (answer.size() > max_bytes) {
        return tl::unexpected{AskError::no_answer};
      }
      continue;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - steady_clock::now());
    if ((errno != EAGAIN && errno != EINTR) || left.count() <= 0) {
      return tl::unexpected{AskError::no_answer};
    }
    pollfd readable{.fd = client.get(), .events = POLLIN, .revents = 0};
    ::poll(&readable, 1, static_cast<int>(left.count()));
  }
}

}  // namespace trestle::console
