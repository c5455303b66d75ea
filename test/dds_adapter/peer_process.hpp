#pragma once
#include <cstdio>
#include <string>

namespace trestle::test {

/// A process that a pipe of ours feeds; it ends with this object.
class PeerProcess {
 public:
  explicit PeerProcess(const std::string& command) : input_{popen(command.c_str(), "we")} {}
  ~PeerProcess() {
    if (input_ != nullptr) {
      pclose(input_);
    }
  }
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

 private:
  std::FILE* input_;
};

}  // namespace trestle::test
