#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <string>

namespace trestle::carry {

/// Standard output, for the counters of a running bridge, which must not wait for their reader: what is not
/// taken at once follows as it is read.
class CounterOutput {
 public:
  /// @param fd  to write to; stays open.
  CounterOutput(boost::asio::io_context& io, int fd) : retry_{io}, fd_{fd} {}

  /// Writes a text. While one before it is not read, it is left out: false.
  bool write(std::string text);
  /// Writes the last one, and gives the reader time. False: not everything could be written, now or before. A
  /// reader that went away is no error.
  [[nodiscard]] bool finish(const std::string& text);

 private:
  void write_rest();
  void write_some();

  boost::asio::steady_timer retry_;
  int fd_;
  std::string text_;
  std::size_t written_ = 0;  ///< of it
  bool failed_ = false;
};

}  // namespace trestle::carry
