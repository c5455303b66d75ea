#include "test/interop/namespaces.hpp"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

namespace trestle::interop {
namespace {

void run(const std::string& command) {
  if (std::system(command.c_str()) != 0) {  // NOLINT(*-env33-c): of our own text only
    throw std::runtime_error{"failed: " + command};
  }
}

void join(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool joined = fd >= 0 && setns(fd, CLONE_NEWNET) == 0;
  close(fd);
  if (!joined) {
    throw std::runtime_error{"cannot join the network namespace " + path};
  }
}

}  // namespace

Namespaces::Namespaces()
    : own_name_{"trestle-own-" + std::to_string(getpid())},
      peer_name_{"trestle-peer-" + std::to_string(getpid())} {
  if (geteuid() != 0) {
    throw std::runtime_error{"network namespaces need root"};
  }
  original_ = open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
  try {
    const std::string own_end = "to" + std::to_string(getpid());
    run("ip netns add " + own_name_);
    run("ip netns add " + peer_name_);
    run("ip link add " + own_end + " netns " + own_name_ + " type veth peer name eth0 netns " + peer_name_);
    run("ip -n " + own_name_ + " link set " + own_end + " name eth0");
    for (const auto& [name, address] : {std::pair{own_name_, "10.77.0.2/24"}, {peer_name_, "10.77.0.1/24"}}) {
      run("ip -n " + name + " addr add " + address + " dev eth0");
      run("ip -n " + name + " link set lo up");
      run("ip -n " + name + " link set eth0 up");
      run("ip -n " + name + " route add 224.0.0.0/4 dev eth0");
    }
    join("/run/netns/" + own_name_);
  } catch (...) {
    remove();
    throw;
  }
}

Namespaces::~Namespaces() {
  if (setns(original_, CLONE_NEWNET) == 0) {
    remove();
  }
}

void Namespaces::remove() noexcept {
  for (const std::string& name : {own_name_, peer_name_}) {
    // NOLINTNEXTLINE(*-env33-c): of our own text only
    static_cast<void>(std::system(("ip netns del " + name + " 2>/dev/null").c_str()));
  }
  close(original_);
}

}  // namespace trestle::interop
