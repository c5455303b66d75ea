#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace trestle::bridge {

struct ConversionError;

/// Logs what went wrong with messages of one route, above all those that could not be converted: the first,
/// then at most one a second, with how many were passed over in between.
class ConversionLog {
 public:
  explicit ConversionLog(std::string topic) : topic_{std::move(topic)} {}
  void refused(const ConversionError& error);
  /// Of anything else.
  void tell(std::string_view what);

 private:
  std::string topic_;
  std::chrono::steady_clock::time_point next_{};
  std::uint64_t passed_over_ = 0;
};

}  // namespace trestle::bridge
