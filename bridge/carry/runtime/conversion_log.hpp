#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "bridge/carry/runtime/conversion_words.hpp"
#include "bridge/carry/runtime/route_clock.hpp"

namespace trestle::carry {

/// Logs what went wrong with messages of one route, above all those that could not be converted: the first,
/// then at most one a second, with how many were passed over in between.
class ConversionLog {
 public:
  ConversionLog(const RouteClock& clock, std::string topic) : clock_{clock}, topic_{std::move(topic)} {}
  /// @param rules  of a SOME/IP payload: for a guess at those of its sender.
  void refused(const messages::ConversionError& error, ByteView input,
               const someip::PayloadRules* rules = nullptr);
  /// Of anything else.
  void tell(std::string_view what);

 private:
  const RouteClock& clock_;
  std::string topic_;
  RouteClock::TimePoint next_{};
  std::uint64_t passed_over_ = 0;
};

}  // namespace trestle::carry
