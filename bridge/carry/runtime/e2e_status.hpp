#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/diagnostics.hpp"
#include "sd/net/e2e_spec.hpp"
#include "someip/core/e2e/checker.hpp"
#include "someip/wire/header.hpp"

namespace trestle::carry {

/// The protection of a method that we offer. The bridge counts and refuses by itself.
/// @param answered  false: nothing goes back that could be protected.
[[nodiscard]] sd::E2eSpec served(someip::MethodId method, const E2eSettings& settings, bool answered);
/// The protection of a method that we call.
[[nodiscard]] sd::E2eSpec called(someip::MethodId method, const E2eSettings& settings, bool answered);

/// What the end-to-end checks of the messages of a route or method have found.
class E2eStatus {
 public:
  /// @param pass  what failed is carried nevertheless.
  explicit E2eStatus(bool pass) : pass_{pass} {}

  /// Is told when the state of the communication has changed.
  void on_change(std::function<void()> changed) { changed_ = std::move(changed); }

  /// Counts a check.
  void note(const someip::e2e::CheckResult& result);
  /// Whether the message that was noted last is carried.
  [[nodiscard]] bool passes() const noexcept;

  /// What was good, and, unless it was carried nevertheless as a loss, what was not.
  [[nodiscard]] std::vector<Counter> counters() const;
  /// @param of  the topic or service whose messages they are. @param at  what they are for SOME/IP.
  [[nodiscard]] Diagnosis diagnosis(const std::string& of, const std::string& at) const;

 private:
  [[nodiscard]] std::uint64_t count(someip::e2e::CheckStatus status) const noexcept {
    return counts_[static_cast<std::size_t>(status)];
  }

  bool pass_;
  std::function<void()> changed_;
  someip::e2e::CheckResult last_{};
  std::array<std::uint64_t, 6> counts_{};  ///< by CheckStatus
};

/// What a diagnosis says of a method: "0x1234.0x0001 method 0x0041".
[[nodiscard]] std::string called_id(someip::ServiceId service, someip::InstanceId instance,
                                    someip::MethodId method);

/// Counts the check of a request, if it is protected.
/// @return the error that it is to be answered with, if it is not let through.
[[nodiscard]] std::optional<someip::ReturnCode> refused_by(std::optional<E2eStatus>& status,
                                                           const someip::Message& request);

/// The counters of the checks, if there are any.
void append_e2e(CounterGroup& group, const std::optional<E2eStatus>& status);

}  // namespace trestle::carry
