#pragma once
#include <string>

#include "bridge/inspect/decode/message_json.hpp"

namespace trestle::inspect {

/// Writes JSON objects to a file descriptor, one a line, many lines at a time.
class LineOutput {
 public:
  /// Ignores SIGPIPE in the whole process: see closed().
  explicit LineOutput(int fd);

  /// Throws std::system_error when it has to write and cannot.
  void print(const Json& object);
  void flush();

  /// The reader has closed its end (`| head`). That is no error: what is printed from now on is dropped.
  [[nodiscard]] bool closed() const noexcept { return closed_; }

 private:
  int fd_;
  std::string buffer_;
  bool closed_ = false;
};

}  // namespace trestle::inspect
