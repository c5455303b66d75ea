#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "bridge/carry/runtime/conversion_words.hpp"

namespace trestle::carry {

/// Logs what went wrong with messages of one route, above all those that could not be converted: the first,
/// then at most one a second, with how many were passed over in between.
class ConversionLog {
 public:
  explicit ConversionLog(std::string topic) : topic_{std::move(topic)} {}
  /// @param rules  of a SOME/IP payload: for a guess at those of its sender.
  void refused(const messages::ConversionError& error, ByteView input,
               const someip::PayloadRules* rules = nullptr);
  /// Of anything else.
  void tell(std::string_view what);

 private:
  std::string topic_;
  std::chrono::steady_clock::time_point next_{};
  std::uint64_t passed_over_ = 0;
};

}  // namespace trestle::carry
