#include "bridge/carry/runtime/e2e_status.hpp"

#include <fmt/format.h>

#include <utility>

#include "sd/net/e2e_channel.hpp"

namespace trestle::carry {

namespace e2e = someip::e2e;
using Status = e2e::CheckStatus;

sd::E2eSpec served(someip::MethodId method, const E2eSettings& settings, bool answered) {
  sd::E2eSpec spec{.id = method,
                   .check = settings.profile,
                   .state_machine = settings.state_machine,
                   .pass_failed = true,
                   .source_id = settings.source_id,
                   .payload_only = settings.payload_only};
  if (answered) {
    spec.protect = settings.profile;
  }
  return spec;
}

sd::E2eSpec called(someip::MethodId method, const E2eSettings& settings, bool answered) {
  sd::E2eSpec spec = served(method, settings, answered);
  std::swap(spec.protect, spec.check);
  return spec;
}

void E2eStatus::note(const e2e::CheckResult& result) {
  ++counts_.at(static_cast<std::size_t>(result.status));
  if (std::exchange(last_, result).state != result.state && changed_) {
    changed_();
  }
}

bool E2eStatus::passes() const noexcept {
  return pass_ || last_.status == Status::ok || last_.status == Status::ok_some_lost;
}

std::vector<Counter> E2eStatus::counters() const {
  const auto failed = pass_ ? Counter::Kind::traffic : Counter::Kind::loss;
  return {{"e2e_ok", count(Status::ok)},
          {"e2e_ok_some_lost", count(Status::ok_some_lost)},
          {"e2e_repeated", count(Status::repeated), failed},
          {"e2e_wrong_sequence", count(Status::wrong_sequence), failed},
          {"e2e_error", count(Status::error), failed}};
}

Diagnosis E2eStatus::diagnosis(const std::string& of, const std::string& at) const {
  using Level = Diagnosis::Level;
  const auto level = [this] {
    switch (last_.state) {
      case e2e::State::valid:
        return Level::ok;
      case e2e::State::init:
        return Level::warn;
      case e2e::State::invalid:
        return Level::error;
      case e2e::State::no_data:
        break;
    }
    return Level::stale;
  };
  Diagnosis result{.level = level(),
                   .name = "trestle: E2E of " + of,
                   .message = to_string(last_.state),
                   .hardware_id = "SOME/IP " + at,
                   .values = {{"state", to_string(last_.state)},
                              {"last check", to_string(last_.status)},
                              {"last fault", to_string(last_.fault)},
                              {"last counter", std::to_string(last_.counter)}}};
  for (const Counter& counter : counters()) {
    result.values.emplace_back(counter.name, std::to_string(counter.count));
  }
  return result;
}

std::string called_id(someip::ServiceId service, someip::InstanceId instance, someip::MethodId method) {
  return fmt::format("0x{:04x}.0x{:04x} method 0x{:04x}", value(service), value(instance), value(method));
}

std::optional<someip::ReturnCode> refused_by(std::optional<E2eStatus>& status,
                                             const someip::Message& request) {
  if (!status || request.check == nullptr) {
    return std::nullopt;
  }
  status->note(*request.check);
  return status->passes() ? std::nullopt : std::optional{someip::e2e::code_of(request.check->status)};
}

void append_e2e(CounterGroup& group, const std::optional<E2eStatus>& status) {
  if (status) {
    const std::vector<Counter> checks = status->counters();
    group.counters.insert(group.counters.end(), checks.begin(), checks.end());
  }
}

}  // namespace trestle::carry
