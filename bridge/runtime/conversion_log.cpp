#include "bridge/runtime/conversion_log.hpp"

#include <spdlog/spdlog.h>

#include "bridge/convert/conversion_plan.hpp"

namespace trestle::bridge {

void ConversionLog::refused(const ConversionError& error) {
  tell("dropped a message that cannot be converted: " + to_string(error));
}

void ConversionLog::tell(std::string_view what) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) {
    ++passed_over_;
    return;
  }
  next_ = now + std::chrono::seconds{1};
  const std::string others =
      passed_over_ == 0 ? "" : " (and " + std::to_string(passed_over_) + " others before)";
  spdlog::warn("{}: {}{}", topic_, what, others);
  passed_over_ = 0;
}

}  // namespace trestle::bridge
