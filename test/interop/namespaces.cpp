#include "test/interop/namespaces.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace trestle::interop {
namespace {

void demand(bool done, const std::string& what) {
  if (!done) {
    throw std::runtime_error{"cannot " + what + ": " + std::generic_category().message(errno)};
  }
}

void write_file(const char* file, const std::string& text) {
  demand(static_cast<bool>(std::ofstream{file} << text << std::flush), std::string{"write to "} + file);
}

void run(const std::string& command) {
  if (std::system(command.c_str()) != 0) {  // NOLINT(*-env33-c): of our own text only
    throw std::runtime_error{"failed: " + command};
  }
}

/// Gives a namespace's devices their addresses; a program that begins so is in that namespace. Segmentation
/// is not left to the device, so that a recording has the frames that a wire would have.
void set_up(const std::string& enter, const std::string& address, const std::string& address_v6) {
  run(enter + " ip -batch - <<'END'\nlink set lo up\nlink set eth0 up gso_max_segs 1\naddr add " + address +
      "/24 dev eth0\naddr add " + address_v6 + "/64 dev eth0 nodad\nroute add 224.0.0.0/4 dev eth0\nEND\n");
  // What clients get is no port of a test (isolated.cpp). Not all systems permit it.
  run(enter + " sh -c 'echo 51000 59000 >/proc/sys/net/ipv4/ip_local_port_range' 2>/dev/null || true");
}

/// Waits for the carrier, as the system may take a second to see that both ends are up, and until the address
/// of IPv6 is one of this end.
void wait_until_up(const std::string& enter, const std::string& address_v6) {
  run("for i in $(seq 1000); do " + enter + " ip -oneline link show dev eth0 | grep -q 'state UP' && " +
      enter + " ip -6 route get " + address_v6 + " | grep -q ^local && exit 0; sleep 0.01; done; exit 1");
}

}  // namespace

Namespaces::Namespaces() {
  if (geteuid() != 0) {  // becomes root where that is no more than ourselves
    const std::string user = std::to_string(geteuid());
    const std::string group = std::to_string(getegid());
    demand(unshare(CLONE_NEWUSER) == 0, "make a user namespace, not being root");
    write_file("/proc/self/setgroups", "deny");
    write_file("/proc/self/uid_map", "0 " + user + " 1");
    write_file("/proc/self/gid_map", "0 " + group + " 1");
  }
  demand(unshare(CLONE_NEWNET) == 0, "make a network namespace");
  const int peers =
      open("/proc/self/ns/net", O_RDONLY);  // NOLINT(*-cloexec): programs that we become have it too
  demand(peers >= 0, "open our network namespace");
  peer_file_ = "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(peers);
  demand(unshare(CLONE_NEWNET | CLONE_NEWNS) == 0, "make a network and a mount namespace");
  demand(mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0, "make our mounts private");
  demand(mount("none", folder, "tmpfs", 0, nullptr) == 0, std::string{"mount "} + folder);
  run("ip link add eth0 type veth peer name eth0 netns " + peer_file_);
  const std::string at_peer = "nsenter --net=" + peer_file_;
  set_up("", "10.77.0.2", own_v6);
  set_up(at_peer, "10.77.0.1", peer_v6);
  wait_until_up("", own_v6);
  wait_until_up(at_peer, peer_v6);
}

bool Namespaces::required() {
  const char* const wish = std::getenv("TRESTLE_REQUIRE_PEERS");
  return wish != nullptr && *wish != '\0' && std::string{wish} != "0";
}

std::vector<std::string> Namespaces::at_peer(const std::vector<std::string>& command) const {
  std::vector<std::string> whole{"setpriv", "--pdeathsig", "KILL", "nsenter", "--net=" + peer_file_};
  whole.insert(whole.end(), command.begin(), command.end());
  return whole;
}

}  // namespace trestle::interop
