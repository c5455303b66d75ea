#include "bridge/cli/protection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "bridge/cli/session.hpp"
#include "bridge/describe/load_e2e.hpp"
#include "sd/net/e2e_channel.hpp"

namespace trestle::cli {
namespace {

using describe::E2eUse;
using someip::e2e::CheckStatus;

/// @return or why it cannot be done.
tl::expected<sd::E2eSpec, std::string> spec_of(const describe::Protection& e2e, someip::MethodId id,
                                               E2eUse use) {
  const auto settings = describe::e2e_settings(e2e, use);
  if (!settings) {
    return tl::unexpected{settings.error()};
  }
  sd::E2eSpec spec{.id = id,
                   .state_machine = settings->state_machine,
                   .source_id = settings->source_id,
                   .payload_only = settings->payload_only};
  if (use != E2eUse::received_event) {
    spec.protect = settings->profile;
  }
  if (use != E2eUse::sent_event) {
    spec.check = settings->profile;
  }
  return spec;
}

/// @return nothing: it has none, or it cannot be done.
std::optional<sd::E2eSpec> spec_of(const describe::Interfaces& interfaces,
                                   const describe::ServiceElement& element, someip::InstanceId instance,
                                   E2eUse use) {
  const describe::Protection* const described = interfaces.protection(element, instance);
  if (described == nullptr) {
    return std::nullopt;
  }
  if (!someip::names_an_instance(instance) && !described->of_instances.empty()) {
    Session::warn(
        fmt::format("the E2E protection of {} is not the same in all instances: {}; without an instance that "
                    "of the others is taken",
                    element.name, other_instances(*described)));
  }
  if (described->profile.empty()) {
    return std::nullopt;
  }
  auto spec = spec_of(*described, element.id, use);
  if (!spec) {
    Session::warn(fmt::format("the E2E protection of {} (profile {}) is left out, and its messages {}: {}",
                              element.name, described->profile,
                              use == E2eUse::received_event ? "are not checked" : "go without it",
                              spec.error()));
    return std::nullopt;
  }
  return std::move(*spec);
}

}  // namespace

tl::expected<sd::E2eSpec, std::string> protection_of_call(const describe::Protection& e2e,
                                                          someip::MethodId method, bool answered) {
  auto spec = spec_of(e2e, method, E2eUse::called);
  if (spec && !answered) {
    spec->check.reset();
  }
  return spec;
}

std::vector<sd::E2eSpec> protection_of_call(const describe::Interfaces& interfaces,
                                            const describe::ServiceElement& method,
                                            someip::InstanceId instance, bool answered) {
  auto spec = spec_of(interfaces, method, instance, E2eUse::called);
  if (!spec) {
    return {};
  }
  if (!answered) {
    spec->check.reset();
  }
  return {std::move(*spec)};
}

std::vector<sd::E2eSpec> protection_of_events(const describe::Interfaces& interfaces,
                                              const sd::SubscribeSpec& subscription, std::uint8_t major) {
  std::vector<sd::E2eSpec> specs;
  const describe::Service* const service = interfaces.service(subscription.service, major);
  if (service == nullptr) {
    return specs;
  }
  const auto index = static_cast<std::size_t>(service - interfaces.model().services.data());
  for (const describe::ServiceElement* const element : interfaces.elements_of(index)) {
    // Without names all events are wanted, and told to the Node: those that are in the eventgroup.
    if (!element->is_event() ||
        std::ranges::find(subscription.events, element->id) == subscription.events.end() ||
        std::ranges::find(element->eventgroups, subscription.eventgroup) == element->eventgroups.end() ||
        std::ranges::find(specs, element->id, &sd::E2eSpec::id) != specs.end()) {
      continue;
    }
    if (auto spec = spec_of(interfaces, *element, subscription.instance, E2eUse::received_event)) {
      spec->pass_failed = true;
      specs.push_back(std::move(*spec));
    }
  }
  return specs;
}

std::vector<sd::E2eSpec> protection_of_service(const describe::Interfaces& interfaces,
                                               const sd::ServiceSpec& service,
                                               std::optional<someip::MethodId> only) {
  std::vector<sd::E2eSpec> specs;
  std::set<someip::MethodId> done;
  const auto add = [&](someip::MethodId id, bool is_event) {
    const describe::ServiceElement* const element = interfaces.element(service.service, service.major, id);
    if (element == nullptr || element->is_event() != is_event || (only && id != *only) ||
        !done.insert(id).second) {
      return;
    }
    if (auto spec =
            spec_of(interfaces, *element, service.instance, is_event ? E2eUse::sent_event : E2eUse::served)) {
      spec->pass_failed = !is_event;
      specs.push_back(std::move(*spec));
    }
  };
  for (const sd::MethodSpec& method : service.methods) {
    add(method.id, false);
  }
  for (const sd::FieldSpec& field : service.fields) {
    if (field.notifier) {
      add(*field.notifier, true);
    }
  }
  for (const sd::EventgroupSpec& group : service.eventgroups) {
    for (const someip::MethodId event : group.events) {
      add(event, true);
    }
  }
  return specs;
}

std::string misfit_of_protection(const sd::E2eSpec& e2e, const std::string& what, ByteView payload) {
  if (!e2e.protect || std::make_shared<sd::E2eChannel>(e2e)->protect({}, {}, {&payload, 1}) != nullptr) {
    return {};
  }
  return fmt::format(
      "{} has {} byte{}, and its E2E profile has no messages of this length (data_bits, min_data_bits, "
      "max_data_bits in the description)",
      what, payload.size(), payload.size() == 1 ? "" : "s");
}

std::string failed_check(const someip::e2e::CheckResult& check, const std::string& what) {
  if (check.status == CheckStatus::ok || check.status == CheckStatus::ok_some_lost) {
    return {};
  }
  return check.status == CheckStatus::error
             ? fmt::format("the E2E check of {} failed: {}", what, to_string(check.fault))
             : fmt::format("the E2E check of {} failed: {}, counter {}", what, to_string(check.status),
                           check.counter);
}

}  // namespace trestle::cli
