#include "bridge/generate/capture_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "bridge/traffic/capture_reader.hpp"
#include "pcaps/capture_file.hpp"
#include "pcaps/traffic.hpp"
#include "sd/wire/message.hpp"

namespace trestle::generate {
namespace {

constexpr std::size_t max_warnings = 100;

/// A connection that both sides can find their step in again; no message of a service.  [feat_req_someip_586]
bool is_magic_cookie(const someip::Header& header) {
  return header.service == someip::ServiceId{0xffff} && someip::value(header.method) != 0x8100;
}

/// 0 and 0xffff are no services: whoever sends them has no id yet, or means any.
bool is_service(someip::ServiceId id) {
  return someip::value(id) != 0 && someip::value(id) != 0xffff;
}
/// As of services.
bool is_instance(someip::InstanceId id) {
  return someip::value(id) != 0 && someip::value(id) != 0xffff;
}

}  // namespace

void CaptureModel::Seen::add(const someip::Message& message, const traffic::Place& place) {
  if (!there) {
    first_frame = place.frame;
  }
  there = true;
  ++messages;
  most_bytes = std::max(most_bytes, static_cast<std::uint32_t>(message.payload.size()));
  transport = place.transport.value_or(Transport::udp);
}

void CaptureModel::note_server(someip::ServiceId service, const traffic::Place& place) {
  if (server_count_ < max_servers &&
      servers_[service].emplace(place.transport.value_or(Transport::udp), place.flow.from).second) {
    ++server_count_;
  }
}

void CaptureModel::add_servers(describe::Model& model) const {
  std::set<someip::ServiceId> offered;
  for (const describe::Instance& one : model.instances) {
    offered.insert(one.service_id.value_or(someip::ServiceId{}));
  }
  for (const auto& [service, endpoints] : servers_) {
    if (offered.contains(service)) {
      continue;
    }
    std::vector<describe::Instance> found;
    for (const auto& [transport, endpoint] : endpoints) {
      const auto port =
          transport == Transport::tcp ? &describe::Instance::tcp_port : &describe::Instance::udp_port;
      auto same = std::ranges::find_if(found, [&, at = endpoint.address](const describe::Instance& one) {
        return one.address == at && !(one.*port);
      });
      if (same == found.end()) {
        found.push_back({.service = fmt::format("service_{:04x}", someip::value(service)),
                         .service_id = service,
                         .address = endpoint.address});
        same = std::prev(found.end());
      }
      (*same).*port = endpoint.port;
    }
    model.instances.insert(model.instances.end(), found.begin(), found.end());
  }
}

CaptureModel::Subscribed CaptureModel::subscribed() const {
  Subscribed all;
  for (const auto& [key, seen] : network_.subscriptions()) {
    if (seen.state != traffic::SeenSubscription::State::acknowledged) {
      continue;
    }
    const auto add = [&, &one = seen](Transport transport, const std::optional<Endpoint>& at) {
      if (at) {
        all[{one.service, transport, *at}].insert(one.eventgroup);
      }
    };
    add(Transport::udp, seen.udp);
    add(Transport::tcp, seen.tcp);
    add(Transport::udp, seen.multicast);
  }
  return all;
}

std::vector<someip::EventgroupId> CaptureModel::eventgroups_of(someip::ServiceId service, const Seen& event,
                                                               const Subscribed& subscribed) {
  std::set<someip::EventgroupId> all;
  for (const auto& [transport, receiver] : event.receivers) {
    const auto found = subscribed.find({service, transport, receiver});
    if (found != subscribed.end() && found->second.size() == 1) {
      all.insert(*found->second.begin());
    }
  }
  return {all.begin(), all.end()};
}

bool CaptureModel::message(const traffic::Place& place, std::size_t offset, const someip::Message& message) {
  const TimePoint time{place.time.time_since_epoch()};
  if (sd::is_sd(message.header)) {
    ++messages_;
    std::vector<traffic::Sighting> sightings;
    network_.on_message(message, place.flow.from, place.flow.to, time, sightings);
    std::ranges::for_each(sightings, [this](const traffic::Sighting& one) { tell(one); });
    return true;
  }
  if (is_tp(message.header.type)) {
    const auto whole = segments_.add(place.flow, message, time);
    if (whole && *whole) {
      this->message(place, offset, {(*whole)->header, (*whole)->payload});
    }
    return true;
  }
  ++messages_;
  if (is_magic_cookie(message.header)) {
    return true;
  }
  if (!is_service(message.header.service)) {
    ++without_service_;
    return true;
  }
  const auto key = std::tuple{message.header.service, message.header.method};
  if (!members_.contains(key) && members_.size() >= max_members) {
    ++passed_over_;
    return true;
  }
  Member& member = members_[key];
  switch (message.header.type) {
    case someip::MessageType::request:
      member.request.add(message, place);
      break;
    case someip::MessageType::request_no_return:
      member.request.add(message, place);
      member.fire_and_forget = true;
      break;
    case someip::MessageType::response:
      member.response.add(message, place);
      member.answered = true;
      note_server(message.header.service, place);
      break;
    case someip::MessageType::error:
      ++member.errors;
      member.answered = true;
      break;
    case someip::MessageType::notification:
      member.event.add(message, place);
      if (member.event.receivers.size() < max_receivers) {
        member.event.receivers.emplace(member.event.transport, place.flow.to);
      }
      note_server(message.header.service, place);
      break;
    default:
      ++passed_over_;
      return true;
  }
  member.interface_version = message.header.interface_version;
  return true;
}

void CaptureModel::sd_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to, TimePoint now) {
  ++messages_;
  std::vector<traffic::Sighting> sightings;
  network_.on_datagram(datagram, from, to, now, sightings);
  std::ranges::for_each(sightings, [this](const traffic::Sighting& one) { tell(one); });
}

void CaptureModel::tell(const traffic::Sighting& sighting) const {
  if (!announced_) {
    return;
  }
  const auto tell = [this](Transport transport, const std::optional<Endpoint>& endpoint) {
    if (endpoint) {
      announced_(transport, *endpoint);
    }
  };
  tell(Transport::udp, sighting.service.udp);
  tell(Transport::tcp, sighting.service.tcp);
  if (sighting.subscription) {
    tell(Transport::udp, sighting.subscription->udp);
    tell(Transport::tcp, sighting.subscription->tcp);
    tell(Transport::udp, sighting.subscription->multicast);
  }
}

void CaptureModel::undecodable(const traffic::Place&, std::size_t, ByteView, const traffic::Violation&) {
  ++passed_over_;
}

void CaptureModel::broken_frame(const traffic::Place&, const traffic::Violation&) {
  ++passed_over_;
}

describe::Reading CaptureModel::reading(const std::string& file) const {
  describe::Reading reading;
  describe::Model& model = reading.model;
  model.files = {file};
  std::map<someip::ServiceId, describe::Service> services;
  const auto service_of = [&](someip::ServiceId id) -> describe::Service& {
    const auto [found, is_new] = services.try_emplace(id);
    if (is_new) {
      found->second.name = fmt::format("service_{:04x}", someip::value(id));
      found->second.id = id;
    }
    return found->second;
  };
  // Offers, by service and instance; the last one that was seen counts.
  std::size_t bad_offers = 0;
  for (const auto& [key, seen] : network_.services()) {
    if (!is_service(seen.service) || !is_instance(seen.instance)) {
      ++bad_offers;
      continue;
    }
    describe::Service& service = service_of(seen.service);
    service.major = seen.major;
    service.minor = seen.minor;
    service.has_version = true;
    describe::Instance instance{.service = service.name, .service_id = seen.service, .id = seen.instance};
    instance.major = seen.major;
    instance.minor = seen.minor;
    instance.observed_ttl_s = seen.ttl_s;
    instance.observed_cycle = seen.cycle;
    if (seen.udp) {
      instance.address = seen.udp->address;
      instance.udp_port = seen.udp->port;
    }
    if (seen.tcp) {
      instance.address = seen.tcp->address;
      instance.tcp_port = seen.tcp->port;
    }
    model.instances.push_back(std::move(instance));
  }
  std::set<std::pair<someip::ServiceId, someip::EventgroupId>> eventgroups;
  for (const auto& [key, seen] : network_.subscriptions()) {
    if (!is_service(seen.service)) {
      continue;
    }
    model.observed_uses.push_back({.client = seen.subscriber.address,
                                   .service = seen.service,
                                   .instance = seen.instance,
                                   .major = seen.major,
                                   .eventgroup = seen.eventgroup,
                                   .udp = seen.udp.has_value(),
                                   .tcp = seen.tcp.has_value(),
                                   .multicast = seen.multicast.has_value()});
    describe::Service& service = service_of(seen.service);
    if (eventgroups.emplace(seen.service, seen.eventgroup).second) {
      service.eventgroups.push_back(
          {.name = fmt::format("eventgroup_{:04x}", someip::value(seen.eventgroup)), .id = seen.eventgroup});
    }
    if (seen.multicast) {
      for (describe::Instance& instance : model.instances) {
        if (instance.service_id != seen.service || instance.id != seen.instance ||
            instance.major != seen.major) {
          continue;
        }
        if (std::ranges::find(instance.multicast, seen.eventgroup, &describe::Multicast::eventgroup) ==
            instance.multicast.end()) {
          instance.multicast.push_back({.eventgroup = seen.eventgroup,
                                        .group = *seen.multicast,
                                        .threshold = 1,
                                        .group_at = describe::Place{}});
        }
      }
    }
  }
  const auto left_out = [&](std::uint64_t count, const char* what) {
    if (count > 0) {
      reading.problems.push_back({.severity = documents::Problem::Severity::warning,
                                  .file = file,
                                  .mark = {},
                                  .text = fmt::format("left out: {} {}", count, what)});
    }
  };
  left_out(without_service_, "messages of service 0x0000 or 0xffff, which are no services");
  left_out(bad_offers, "offers of a service or an instance 0x0000 or 0xffff, which are none");
  const Subscribed receivers = subscribed();
  for (const auto& [key, member] : members_) {
    const auto& [service_id, id] = key;
    describe::Service& service = service_of(service_id);
    if (!service.has_version) {
      service.major = member.interface_version;
    }
    bool has_event = member.event.there;
    bool has_method = member.request.there || member.answered;
    if (has_event && has_method) {
      const std::uint64_t of_method = member.request.messages + member.response.messages + member.errors;
      const bool is_event = member.event.messages > of_method;
      (is_event ? has_method : has_event) = false;
      if (reading.problems.size() < max_warnings) {
        reading.problems.push_back(
            {.severity = documents::Problem::Severity::warning,
             .file = file,
             .mark = {},
             .text = fmt::format("{} has a method and an event of the id 0x{:04x}: {} messages are of the "
                                 "method, {} of the event; the {} is left out",
                                 service.name, someip::value(id), of_method, member.event.messages,
                                 is_event ? "method" : "event")});
      }
    }
    if (has_event) {
      describe::Event event{.name = fmt::format("event_{:04x}", someip::value(id)), .id = id};
      event.transfer.transport = member.event.transport;
      event.transfer.transport_at = event.place;
      event.observed_bytes = member.event.most_bytes;
      event.payload.known = false;
      event.eventgroups = eventgroups_of(service_id, member.event, receivers);
      service.events.push_back(std::move(event));
    }
    if (has_method) {
      describe::Method method{.name = fmt::format("method_{:04x}", someip::value(id)), .id = id};
      method.fire_and_forget = member.fire_and_forget && !member.answered;
      // Of a direction that was not seen: as the other one.
      method.request_transfer.transport = (member.request.there ? member.request : member.response).transport;
      method.response_transfer.transport =
          (member.response.there ? member.response : member.request).transport;
      method.request_transfer.transport_at = method.response_transfer.transport_at = method.place;
      method.request.known = false;
      method.response.known = false;
      method.observed_bytes = std::max(member.request.most_bytes, member.response.most_bytes);
      service.methods.push_back(std::move(method));
    }
  }
  for (auto& [id, service] : services) {
    std::ranges::sort(service.eventgroups, {}, &describe::Eventgroup::id);
    if (service.eventgroups.size() == 1) {
      for (describe::Event& event : service.events) {
        event.eventgroups = {service.eventgroups.front().id};
      }
    }
    model.services.push_back(std::move(service));
  }
  add_servers(model);
  std::vector<documents::Problem> open = what_is_open(model);
  reading.problems.insert(reading.problems.end(), std::make_move_iterator(open.begin()),
                          std::make_move_iterator(open.end()));
  return reading;
}

std::vector<documents::Problem> what_is_open(const describe::Model& model) {
  std::vector<documents::Problem> open;
  for (const describe::Service& service : model.services) {
    std::vector<std::string> events;
    for (const describe::Event& event : service.events) {
      if (event.eventgroups.empty()) {
        events.push_back(event.name);
      }
    }
    if (events.empty()) {
      continue;
    }
    std::vector<std::string> groups;
    for (const describe::Eventgroup& group : service.eventgroups) {
      groups.push_back(fmt::format("0x{:04x}", someip::value(group.id)));
    }
    open.push_back(
        {.severity = documents::Problem::Severity::warning,
         .file = model.files.empty() ? std::string{} : model.files.front(),
         .mark = {},
         .text = groups.empty()
                     ? fmt::format("{}: no subscription was seen; the eventgroups of {} are left open",
                                   service.name, fmt::join(events, ", "))
                     : fmt::format("{}: nothing tells which of the eventgroups {} these events are in, which "
                                   "is left open: {}",
                                   service.name, fmt::join(groups, ", "), fmt::join(events, ", "))});
  }
  return open;
}

describe::Reading read_capture(const std::string& file) {
  describe::Reading reading;
  const auto error = [&](std::string text) {
    reading.problems.push_back({.file = file, .mark = {}, .text = std::move(text)});
  };
  try {
    pcaps::CaptureFile capture{file};
    traffic::CaptureReader* learner = nullptr;
    CaptureModel sink{[&](Transport transport, const Endpoint& at) { learner->learn(transport, at); }};
    traffic::CaptureReader reader{{}, sink};
    learner = &reader;
    pcaps::Traffic traffic{reader};
    while (const std::optional<pcaps::Frame> frame = capture.next()) {
      traffic.on_frame(*frame);
    }
    traffic.finish();
    reader.finish();
    reading = sink.reading(file);
    if (!capture.error().empty()) {
      // Cut off where the recording ended, as a rule: what is before that is there.
      error("the capture cannot be read to its end: " + capture.error());
      reading.problems.back().severity =
          sink.messages() == 0 ? documents::Problem::Severity::error : documents::Problem::Severity::warning;
    } else if (sink.messages() == 0) {
      error("no SOME/IP message was found");
    }
  } catch (const std::runtime_error& failure) {
    error(failure.what());
  }
  return reading;
}

}  // namespace trestle::generate
