#include "bridge/conform/fuzz/sequences.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "bridge/conform/fuzz/described.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;

/// What one datagram of an Ethernet frame carries.
constexpr std::size_t max_datagram = 1'400;
/// Longer payloads take more time, and few parsers look at them in another way.
constexpr std::size_t max_payload = 4'000;
constexpr std::uint32_t long_ttl_s = 300;

Step sd_step(fuzz::Bytes bytes, bool multicast, bool counted = true) {
  return {
      .way = multicast ? Way::sd_multicast : Way::sd_unicast, .bytes = std::move(bytes), .counted = counted};
}

/// Methods of the Enhanced Testability Service, but for suspendInterface, which makes the device silent.
constexpr std::array<std::uint16_t, 23> testability_methods{0x03, 0x08, 0x09, 0x0a, 0x0b, 0x0e, 0x0f, 0x10,
                                                            0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x18,
                                                            0x19, 0x1a, 0x1b, 0x1c, 0x26, 0x27, 0x34};

/// Whatever became of a message by changing it: it calls this method no more.
void never_call(fuzz::Bytes& bytes, std::uint16_t service, std::uint16_t method) {
  const std::array<std::byte, 4> id{std::byte(service >> 8U), std::byte(service & 0xffU),
                                    std::byte(method >> 8U), std::byte(method & 0xffU)};
  for (auto at = bytes.begin(); (at = std::search(at, bytes.end(), id.begin(), id.end())) != bytes.end();
       ++at) {
    at[2] ^= std::byte{0x80};
  }
}

}  // namespace

std::vector<Target> targets_of(const Profile& profile) {
  std::vector<Target> all;
  for (const ServiceProfile& one : profile.services) {
    Target target{.service = {.service = value(one.service),
                              .instance = value(one.instance),
                              .major = one.major,
                              .minor = one.minor},
                  .udp_port = one.udp_port.value_or(0),
                  .tcp_port = one.tcp_port.value_or(0)};
    auto& methods = target.service.methods;
    if (one.request) {
      methods.push_back(value(one.request->method));
    }
    if (one.fire_and_forget) {
      methods.push_back(value(*one.fire_and_forget));
    }
    if (one.field) {
      methods.push_back(value(one.field->getter));
      methods.push_back(value(one.field->setter));
    }
    for (const E2eProtection& protection : one.e2e) {
      if (!is_of_event(protection)) {
        methods.push_back(value(protection.id));
      }
    }
    for (const EventgroupProfile& group : one.eventgroups) {
      target.service.eventgroups.push_back(value(group.id));
    }
    if (profile.ets && all.empty()) {
      target.never = 0x02;
      methods.insert(methods.end(), testability_methods.begin(), testability_methods.end());
    }
    all.push_back(std::move(target));
  }
  return all;
}

std::vector<fuzz::KnownService> wanted_services(const Profile& profile) {
  std::vector<fuzz::KnownService> all;
  for (const UsedService& one : profile.uses) {
    fuzz::KnownService service{
        .service = value(one.service), .instance = value(one.instance), .major = one.major};
    for (const auto* group : {&one.udp, &one.tcp, &one.multicast}) {
      if (*group) {
        service.eventgroups.push_back(value((*group)->id));
        service.events.push_back(value((*group)->event));
      }
    }
    all.push_back(std::move(service));
  }
  return all;
}

Sequences::Sequences(std::vector<Target> targets, std::vector<fuzz::KnownService> wanted, const Endpoint& own,
                     const describe::Model* model)
    : own_{own}, model_{model} {
  for (Target& one : targets) {
    add(std::move(one));
  }
  for (fuzz::KnownService& one : wanted) {
    add_wanted(std::move(one));
  }
}

void Sequences::add(Target target) {
  if (model_ != nullptr) {
    add_described(target.service, *model_);
  }
  targets_.push_back(std::move(target));
}

void Sequences::add_wanted(fuzz::KnownService service) {
  if (model_ != nullptr) {
    add_described(service, *model_);
  }
  unreachable_.push_back({.service = service});
  wanted_.push_back(std::move(service));
}

/// Of a device without services: one that it uses, at which it cannot be reached.
const Target& Sequences::any_target(fuzz::Random& random) const {
  static const Target none;
  const std::vector<Target>& some = targets_.empty() ? unreachable_ : targets_;
  return some.empty() ? none : random.pick(some);
}

/// One thing in it, by its type where that is known.
void Sequences::change_message(fuzz::Bytes& bytes, std::size_t max_size, fuzz::Random& random) const {
  if (random.chance(60)) {
    const bool done = std::ranges::any_of(targets_,
                                          [&](const Target& one) {
                                            return fuzz::mutate_typed(bytes, one.service, max_size, random);
                                          }) ||
                      std::ranges::any_of(wanted_, [&](const fuzz::KnownService& one) {
                        return fuzz::mutate_typed(bytes, one, max_size, random);
                      });
    if (done) {
      return;
    }
  }
  fuzz::mutate(bytes, max_size, random);
}

void Sequences::change_some(fuzz::Bytes& bytes, std::size_t max_size, fuzz::Random& random) const {
  for (std::size_t count = random.below(4); count > 0; --count) {
    change_message(bytes, max_size, random);
  }
}

void Sequences::lead_into_state(Sequence& sequence, const Target& target, fuzz::Random& random) const {
  const fuzz::KnownService& service = target.service;
  auto& steps = sequence.steps;
  switch (random.below(8)) {
    case 0:
    case 1:
      sequence.state = "subscribed";
      for (const std::uint16_t group : service.eventgroups) {
        steps.push_back(sd_step(fuzz::make_subscribe(service, group, long_ttl_s, own_), false));
      }
      break;
    case 2:
      sequence.state = "connected";
      if (target.tcp_port != 0) {
        steps.push_back(
            {.way = Way::tcp, .port = target.tcp_port, .bytes = fuzz::make_request(service, 8, random)});
      }
      break;
    case 3:
      sequence.state = "half a message";
      if (target.udp_port != 0) {
        fuzz::Bytes request = fuzz::make_request(service, 0, random);
        request.resize(16 + 3 * max_datagram);
        std::vector<fuzz::Bytes> segments = fuzz::make_segments(request, 1'392);
        segments.pop_back();
        for (fuzz::Bytes& one : segments) {
          steps.push_back({.way = Way::udp, .port = target.udp_port, .bytes = std::move(one)});
        }
      }
      break;
    case 4:
      sequence.state = "calls pending";
      for (std::size_t count = target.udp_port == 0 ? 0 : 16; count > 0; --count) {
        steps.push_back(
            {.way = Way::udp, .port = target.udp_port, .bytes = fuzz::make_request(service, 8, random)});
      }
      break;
    case 5:
      sequence.state = after_reboot;
      break;
    case 6:
      sequence.state = "offered";
      for (const fuzz::KnownService& one : wanted_) {
        steps.push_back(sd_step(fuzz::make_offer(one, long_ttl_s, own_), true));
      }
      break;
    default:
      sequence.state = "idle";
      break;
  }
}

/// From the tester's UDP port, at which it offers the service.
void Sequences::append_event(Sequence& sequence, fuzz::Random& random) const {
  const auto& [service, port] = random.pick(subscribers_);
  const auto known = std::ranges::find(wanted_, service, &fuzz::KnownService::service);
  if (known == wanted_.end()) {
    return;
  }
  fuzz::Bytes event = fuzz::make_notification(*known, max_datagram, random);
  change_some(event, max_datagram, random);
  sequence.steps.push_back({.way = Way::udp, .port = port, .bytes = std::move(event)});
}

void Sequences::append_discovery(Sequence& sequence, const Target& target, fuzz::Random& random) const {
  const bool of_ours = !wanted_.empty() && random.chance(20);
  fuzz::Bytes bytes = fuzz::make_discovery(of_ours ? random.pick(wanted_) : target.service, own_, random);
  change_some(bytes, max_datagram, random);
  sequence.steps.push_back(sd_step(std::move(bytes), random.chance(30), random.chance(85)));
}

void Sequences::append_step(Sequence& sequence, const Target& target, fuzz::Random& random) const {
  auto& steps = sequence.steps;
  const std::size_t kind = random.below(20);
  if (kind < 2 && !subscribers_.empty()) {
    append_event(sequence, random);
    return;
  }
  if (kind < 10 || (target.udp_port == 0 && target.tcp_port == 0)) {
    append_discovery(sequence, target, random);
    return;
  }
  fuzz::Bytes request = fuzz::make_request(target.service, max_payload, random);
  if (target.tcp_port != 0 && (kind < 13 || target.udp_port == 0)) {
    change_some(request, max_payload, random);
    if (random.chance(10)) {
      steps.push_back({.way = Way::tcp_close, .port = target.tcp_port});
    } else if (random.chance(25) && request.size() > 1) {  // in two pieces
      const auto at = static_cast<std::ptrdiff_t>(1 + random.below(request.size() - 1));
      steps.push_back({.way = Way::tcp,
                       .port = target.tcp_port,
                       .bytes = {request.begin(), request.begin() + at},
                       .pause = 1ms});
      request.erase(request.begin(), request.begin() + at);
    }
    steps.push_back({.way = Way::tcp, .port = target.tcp_port, .bytes = std::move(request)});
    return;
  }
  if (kind < 16) {
    for (fuzz::Bytes& one : fuzz::make_segments(request, 16 * (1 + random.below(87)))) {
      if (random.chance(10)) {
        change_some(one, max_datagram, random);
      }
      if (!random.chance(3)) {  // else it is lost
        steps.push_back({.way = Way::udp, .port = target.udp_port, .bytes = std::move(one)});
      }
    }
    return;
  }
  change_some(request, max_datagram, random);
  steps.push_back({.way = Way::udp, .port = target.udp_port, .bytes = std::move(request)});
}

Sequence Sequences::make(fuzz::Random& random) const {
  Sequence sequence;
  const Target& target = any_target(random);
  lead_into_state(sequence, target, random);
  for (std::size_t count = 1 + random.below(8); count > 0; --count) {
    append_step(sequence, target, random);
  }
  keep_harmless(sequence);
  return sequence;
}

std::vector<Sequence> Sequences::make_spoilt(fuzz::Random& random) const {
  constexpr std::size_t steps_of_one = 8;
  std::vector<Sequence> all;
  for (const Target& target : targets_) {
    const bool udp = target.udp_port != 0;
    if (!udp && target.tcp_port == 0) {
      continue;
    }
    for (fuzz::Bytes& request : fuzz::make_spoilt_requests(target.service, max_datagram - 16, random)) {
      if (all.empty() || all.back().steps.size() == steps_of_one) {
        all.push_back({.state = "idle"});
      }
      all.back().steps.push_back({.way = udp ? Way::udp : Way::tcp,
                                  .port = udp ? target.udp_port : target.tcp_port,
                                  .bytes = std::move(request)});
    }
  }
  for (Sequence& one : all) {
    keep_harmless(one);
  }
  return all;
}

void Sequences::keep_harmless(Sequence& sequence) const {
  for (const Target& target : targets_) {
    for (Step& step : sequence.steps) {
      if (target.never) {
        never_call(step.bytes, target.service.service, *target.never);
      }
    }
  }
}

Sequence Sequences::changed(Sequence sequence, const Sequence& other, fuzz::Random& random) const {
  auto& steps = sequence.steps;
  constexpr std::size_t max_steps = 64;
  for (std::size_t count = 1 + random.below(3); count > 0; --count) {
    if (steps.empty()) {
      append_step(sequence, any_target(random), random);
      continue;
    }
    const std::size_t at = random.below(steps.size());
    const auto place = steps.begin() + static_cast<std::ptrdiff_t>(at);
    switch (random.below(8)) {
      case 0:
        steps.erase(place);
        break;
      case 1:
        steps.insert(place, Step{steps[at]});
        break;
      case 2:
        std::swap(steps[at], steps[random.below(steps.size())]);
        break;
      case 3:
        if (!other.steps.empty()) {
          steps.insert(place, random.pick(other.steps));
        }
        break;
      case 4:
        if (!other.steps.empty()) {
          steps[at].bytes =
              fuzz::cross_over(steps[at].bytes, random.pick(other.steps).bytes, max_datagram, random);
        }
        break;
      default:
        change_message(steps[at].bytes, max_datagram, random);
        break;
    }
  }
  steps.resize(std::min(steps.size(), max_steps));
  keep_harmless(sequence);
  return sequence;
}

}  // namespace trestle::conform
