#include "bridge/carry/runtime/conversion_log.hpp"

#include <spdlog/spdlog.h>

namespace trestle::carry {

void ConversionLog::refused(const messages::ConversionError& error, ByteView input,
                            const someip::PayloadRules* rules) {
  if (clock_.now() < next_) {
    ++passed_over_;
    return;
  }
  tell("dropped a message that cannot be converted: " +
       (rules != nullptr ? in_words(error, input, *rules) : in_words(error, input)));
}

void ConversionLog::tell(std::string_view what) {
  const auto now = clock_.now();
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

}  // namespace trestle::carry
