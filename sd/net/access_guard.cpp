#include "sd/net/access_guard.hpp"

#include <algorithm>
#include <random>

#include "sd/net/clock.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::sd {
namespace {

bool is_about(const AccessRule& rule, const AccessGuard::Subject& subject) {
  const auto has = [](const auto& list, const auto& one) {
    return list.empty() || std::ranges::find(list, one) != list.end();
  };
  return rule.first_service <= subject.service && subject.service <= rule.last_service &&
         (rule.instance == someip::any_instance || rule.instance == subject.instance) &&
         has(rule.allow, subject.access) &&
         (subject.access != Access::call || has(rule.methods, someip::MethodId{subject.member})) &&
         (subject.access != Access::subscribe || has(rule.eventgroups, someip::EventgroupId{subject.member}));
}

bool has(const std::vector<Subnet>& peers, const IpAddress& from) {
  return std::ranges::any_of(peers, [&](const Subnet& subnet) { return subnet.has(from); });
}

std::string describe(const AccessGuard::Subject& subject) {
  const std::string service = to_string(subject.service, subject.instance);
  const std::string member = hexadecimal(subject.member);
  switch (subject.access) {
    case Access::subscribe:
      return "a subscription to eventgroup " + member + " of " + service;
    case Access::call:
      return "a call of method " + member + " of " + service;
    case Access::offer:
      break;
  }
  return "an offer of " + service;
}

}  // namespace

PeerRate::PeerRate(std::uint32_t per_second, std::uint32_t seed) {
  if (per_second != 0) {
    pause_ = std::chrono::duration_cast<Duration>(std::chrono::seconds{1}) / per_second;
    free_at_.emplace(seed, TimePoint{});
  }
}

bool PeerRate::take(const IpAddress& from, std::uint64_t more, TimePoint now) noexcept {
  if (!free_at_) {
    return true;
  }
  TimePoint& free_at = free_at_->at(from, more);
  const TimePoint next = std::max(free_at, now) + pause_;
  if (next > now + std::chrono::seconds{1}) {
    return false;
  }
  free_at = next;
  return true;
}

AccessGuard::AccessGuard(const NodeConfig& config, NodeCounters& counters, DiscoveryLog warn)
    : control_{config.access},
      counters_{counters},
      warn_{std::move(warn)},
      requests_{config.max_requests_per_second, std::random_device{}()},
      connections_{config.max_tcp_connects_per_second, std::random_device{}()},
      max_requests_per_second_{config.max_requests_per_second},
      max_tcp_connects_per_second_{config.max_tcp_connects_per_second} {
  for (const AccessPolicy& given : control_.policies) {
    Policy& policy = policies_.emplace_back();
    policy.allow_others = given.allow_others;
    for (const AccessRule& rule : given.rules) {
      (rule.first_service == rule.last_service ? policy.of_service[rule.first_service] : policy.of_ranges)
          .push_back(&rule);
    }
  }
}

bool AccessGuard::Policy::allows(const Subject& subject, const IpAddress& from) const noexcept {
  bool is_ruled = false;
  const auto judge = [&](const std::vector<const AccessRule*>& rules) {
    return std::ranges::any_of(rules, [&](const AccessRule* rule) {
      const bool counts = is_about(*rule, subject);
      is_ruled = is_ruled || counts;
      return counts && has(rule->peers, from);
    });
  };
  const auto found = of_service.find(subject.service);
  return (found != of_service.end() && judge(found->second)) || judge(of_ranges) ||
         (!is_ruled && allow_others);
}

bool AccessGuard::is_peer(const IpAddress& from) const noexcept {
  return has(control_.peers, from);
}

bool AccessGuard::not_heard(const IpAddress& from) {
  ++counters_.peers_not_allowed;
  if (const std::uint64_t times = not_heard_.to_tell(1)) {
    warn_("dropped what came from " + someip::to_string(from) + ": it is not among the allowed peers" +
          and_others(times));
  }
  return false;
}

bool AccessGuard::accepts(const IpAddress& from) {
  if (!hears(from)) {
    return false;
  }
  if (connections_.take(from, 0, now())) {
    return true;
  }
  ++counters_.too_many_connects;
  if (const std::uint64_t times = too_many_connections_.to_tell(1)) {
    warn_("refused a TCP connection of " + someip::to_string(from) + ": it connects more than " +
          std::to_string(max_tcp_connects_per_second_) + " times a second (max_tcp_connects_per_second)" +
          and_others(times));
  }
  return false;
}

std::uint64_t& AccessGuard::counter_of(Access access) noexcept {
  return access == Access::offer       ? counters_.offers_not_allowed
         : access == Access::subscribe ? counters_.subscriptions_not_allowed
                                       : counters_.calls_not_allowed;
}

bool AccessGuard::allows(const Subject& subject, const IpAddress& from) noexcept {
  if (std::ranges::all_of(policies_, [&](const Policy& policy) { return policy.allows(subject, from); })) {
    return true;
  }
  ++counter_of(subject.access);
  Refused& refused = refused_[static_cast<std::size_t>(subject.access)];
  refused.subject = subject;
  refused.from = from;
  ++refused.unsaid;
  return false;
}

void AccessGuard::say_what_was_refused() {
  for (Refused& refused : refused_) {
    if (refused.unsaid == 0) {
      continue;
    }
    if (const std::uint64_t times = refused.line.to_tell(std::exchange(refused.unsaid, 0))) {
      warn_("refused " + describe(refused.subject) + " by " + someip::to_string(refused.from) +
            ": access control does not allow it" + and_others(times));
    }
  }
}

bool AccessGuard::takes_limited_request(const IpAddress& from, Transport transport) {
  if (requests_.take(from, static_cast<std::uint64_t>(transport), now())) {
    return true;
  }
  ++counters_.too_many_requests;
  if (const std::uint64_t times = too_many_requests_.to_tell(1)) {
    warn_("dropped a request of " + someip::to_string(from) + ": it sends more than " +
          std::to_string(max_requests_per_second_) + " a second (max_requests_per_second)" +
          and_others(times));
  }
  return false;
}

}  // namespace trestle::sd
