#pragma once
#include <string>
#include <utility>

namespace trestle::messages {

/// Why a message cannot be carried. Only the first reason is kept: those that follow are often its
/// consequences.
class FirstComplaint {
 public:
  /// @param message  its name.
  explicit FirstComplaint(std::string message) : message_{std::move(message)} {}

  void operator()(const std::string& reason) {
    if (text_.empty()) {
      text_ = message_ + " cannot be carried: " + reason;
    }
  }
  /// Empty while there is none.
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  std::string message_;
  std::string text_;
};

}  // namespace trestle::messages
