// isolated PROGRAM [ARGUMENT ...]: becomes that program, in a network namespace of its own that has nothing
// but loopback, with a /dev/shm of its own, and for root a /run/trestle. So no test hears, or disturbs, what
// another one sends: not its multicast groups, its ports, its DDS domains, nor what it floods loopback with.
// Nor does it find the bridges of another one. Where the system permits no namespaces it becomes the program
// all the same; tests have addresses of their own (loopback.hpp), so most get on with each other.
#include <fcntl.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

bool write_file(const char* file, const std::string& text) {
  const int at = open(file, O_WRONLY | O_CLOEXEC);
  const bool done = at >= 0 && write(at, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (at >= 0) {
    close(at);
  }
  return done;
}

bool has_loopback_up() {
  const int sock = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP;
  const bool done = sock >= 0 && ioctl(sock, SIOCSIFFLAGS, &request) == 0;
  if (sock >= 0) {
    close(sock);
  }
  return done;
}

// The ports that the system gives to clients are none that a test listens at: else a socket of DDS that chose
// none may have the port of a service. Not all systems permit it.
void keep_ports_of_tests_free() {
  static_cast<void>(write_file("/proc/sys/net/ipv4/ip_local_port_range", "51000 59000"));
}

// Where the bridges of root have their sockets (docs/status.md).
bool hide_other_bridges() {
  constexpr const char* folder = "/run/trestle";
  return geteuid() != 0 || (mkdir(folder, 0755) != 0 && errno != EEXIST) ||
         mount("none", folder, "tmpfs", MS_NOSUID | MS_NODEV, "mode=0755") == 0;
}

// Last what cannot be undone. Who is not root stays who he is, in a user namespace of his own.
bool isolate() {
  if (const uid_t user = geteuid(); user != 0) {
    const std::string group = std::to_string(getegid());
    if (unshare(CLONE_NEWUSER) != 0 || !write_file("/proc/self/setgroups", "deny") ||
        !write_file("/proc/self/uid_map", std::to_string(user) + " " + std::to_string(user) + " 1") ||
        !write_file("/proc/self/gid_map", group + " " + group + " 1")) {
      return false;
    }
  }
  return unshare(CLONE_NEWNS) == 0 && mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount("none", "/dev/shm", "tmpfs", MS_NOSUID | MS_NODEV, nullptr) == 0 && hide_other_bridges() &&
         unshare(CLONE_NEWNET) == 0 && has_loopback_up();
}

// Systems permit it to others than root, or do not, or only half of it: a child tries.
bool can_isolate() {
  if (geteuid() == 0) {
    return true;
  }
  const pid_t child = fork();
  if (child == 0) {
    _exit(isolate() ? 0 : 1);
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: isolated PROGRAM [ARGUMENT ...]\n", stderr);
    return 2;
  }
  if (!can_isolate() || !isolate()) {
    std::puts("not isolated from other tests: the system permits no network namespace");
  } else {
    keep_ports_of_tests_free();
  }
  execvp(argv[1], argv + 1);
  std::perror(argv[1]);
  return 1;
}
