#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "bridge/carry/config/bridge_config.hpp"

namespace trestle::carry {

using Clock = std::chrono::steady_clock;

/// One message that crossed the bridge, with the checkpoints of its conversion.
struct Carried {
  std::string_view topic;
  Direction direction{};
  someip::SessionId session{};  ///< of the SOME/IP message, which tells the two bridges' lines apart
  Clock::time_point before;     ///< the conversion: (1) or (3)
  Clock::time_point after;      ///< the conversion: (2) or (4)
  std::chrono::nanoseconds source_time{0};  ///< DDS to SOME/IP: when the DDS writer wrote it, since 1970
  std::size_t bytes = 0;                    ///< of the converted message
};

/// What a running bridge tells a program that watches it: one JSON object a line, written to a file
/// descriptor. docs/cli.md documents the lines. Never waits: a line that the descriptor does not take at once
/// is left out and counted.
class Report {
 public:
  /// @param fd  -1: nothing is written.
  explicit Report(int fd = -1);
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;

  void carried(const Carried& carried);
  /// Something that discovery found or lost.
  void discovery(std::string_view text);
  /// A line that is already JSON.
  void line(std::string json);
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }
  [[nodiscard]] std::uint64_t lines_left_out() const noexcept { return lines_left_out_; }

 private:
  int fd_;
  std::uint64_t lines_left_out_ = 0;
};

}  // namespace trestle::carry
