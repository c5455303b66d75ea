#include "bridge/conform/cases/our_service.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace trestle::conform {

const UsedService& used_service(Trial& t, bool by_ets) {
  const auto found = std::ranges::find(t.profile.uses, by_ets, &UsedService::by_ets);
  if (found == t.profile.uses.end()) {
    t.unsupported("no such service in the profile");
  }
  return *found;
}

OurService::OurService(Trial& trial, const UsedService& used, bool with_tcp)
    : t_{trial}, used_{used}, udp_{trial.tester.open_udp()} {
  if (with_tcp) {
    tcp_ = t_.tester.listen();
  }
}

void OurService::reboot() {
  offer();
  t_.pass();
  t_.sessions.reboot();
}

void OurService::move() {
  udp_ = t_.tester.open_udp();
}

SdStimulus OurService::offer_message(std::uint32_t ttl_s) const {
  std::vector<Bytes> endpoints{endpoint_option(udp(), Transport::udp)};
  if (tcp_) {
    endpoints.push_back(endpoint_option(t_.tester.local(*tcp_), Transport::tcp));
  }
  return Trial::offer_of(used_, std::move(endpoints), ttl_s);
}

std::optional<SeenEntry> OurService::subscribe_since(std::size_t since, Duration within,
                                                     std::optional<someip::EventgroupId> group) {
  return t_.await_entry(since, within, is_subscribe(group));
}

Trial::EntryIs OurService::is_subscribe(std::optional<someip::EventgroupId> group) const {
  return [service = used_.service, group](const SeenEntry& seen) {
    return seen.entry.kind() == sd::EntryKind::subscribe_eventgroup && seen.entry.service == service &&
           (!group || seen.entry.eventgroup() == *group);
  };
}

SeenEntry OurService::subscribed_to(const SdStimulus& offer, std::optional<someip::EventgroupId> group) {
  if (auto seen = t_.asked_for([&] { t_.offer_ours(offer); }, is_subscribe(group))) {
    return *seen;
  }
  t_.missing("no SubscribeEventgroup in answer to an offer", "a SubscribeEventgroup");
}

void OurService::answer(const SeenEntry& subscribe, bool good, std::optional<Endpoint> multicast) {
  SdStimulus message;
  sd::Entry entry = subscribe.entry;
  entry.type = sd::EntryType::subscribe_eventgroup_ack;
  entry.first_run = {};
  entry.second_run = {};
  entry.tail = sd::Entry::eventgroup_tail(entry.eventgroup(), entry.counter(), false);
  entry.ttl_s = good ? entry.ttl_s : 0;
  if (multicast) {
    message.options = {endpoint_option(*multicast, Transport::udp)};
    message.options.front()[2] = static_cast<std::byte>(
        multicast->address.v6 ? sd::OptionType::ipv6_multicast : sd::OptionType::ipv4_multicast);
    entry.first_run.count = 1;
  }
  message.entries = {entry};
  t_.send_sd(message, false, good ? "SubscribeEventgroupAck" : "SubscribeEventgroupNack");
}

void OurService::acknowledge_all(std::size_t since, std::size_t count, std::optional<Endpoint> multicast) {
  std::set<someip::EventgroupId> done;
  const auto look = [&] {
    for (const SeenEntry& seen : t_.entries_since(since, [&](const SeenEntry& one) {
           return one.entry.kind() == sd::EntryKind::subscribe_eventgroup &&
                  one.entry.service == used_.service;
         })) {
      if (done.insert(seen.entry.eventgroup()).second) {
        const bool to_group = used_.multicast && seen.entry.eventgroup() == used_.multicast->id;
        answer(seen, true, to_group ? multicast : std::nullopt);
      }
    }
    return done.size() >= count;
  };
  t_.tester.receive(2 * t_.profile.timing.answer_within, look);
}

Bytes OurService::event_message(someip::MethodId event, std::uint8_t number) {
  const Call message{.service = used_.service,
                     .method = event,
                     .payload = bytes({number}),
                     .interface_version = used_.major,
                     .type = someip::MessageType::notification,
                     .client = {},
                     .session = someip::SessionId{++session_}};
  return message.encode();
}

void OurService::notify(someip::MethodId event, std::uint8_t number, const Endpoint& to) {
  t_.tester.send(udp_, event_message(event, number), to);
  t_.is_stimulus("event");
}

void OurService::notify(someip::MethodId event, std::uint8_t number, PortId connection) {
  t_.tester.send(connection, event_message(event, number));
  t_.is_stimulus("event");
}

Trial::EntryIs OurService::is_find() const {
  return [service = used_.service](const SeenEntry& seen) {
    return seen.entry.kind() == sd::EntryKind::find_service && seen.entry.service == service;
  };
}

}  // namespace trestle::conform
