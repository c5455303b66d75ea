#pragma once
#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace trestle::console {

/// A text that is made when somebody asks for it, and shared by all who ask soon after. Making it takes at
/// most a twentieth of the time, however often it is asked for.
class FreshText {
 public:
  static constexpr std::chrono::milliseconds least{100};
  static constexpr int share = 20;

  explicit FreshText(std::function<std::string()> make) : make_{std::move(make)} {}

  [[nodiscard]] std::shared_ptr<const std::string> now() {
    const auto asked = std::chrono::steady_clock::now();
    if (!text_ || asked >= stale_) {
      text_ = std::make_shared<const std::string>(make_());
      const auto made = std::chrono::steady_clock::now();
      stale_ = made + std::max<std::chrono::steady_clock::duration>(least, share * (made - asked));
    }
    return text_;
  }

 private:
  std::function<std::string()> make_;
  std::shared_ptr<const std::string> text_;
  std::chrono::steady_clock::time_point stale_{};
};

}  // namespace trestle::console
