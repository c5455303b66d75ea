#include <algorithm>
#include <utility>

#include "bridge/conform/trial.hpp"

// What a case sends, and the answers that it waits for.
namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using someip::MessageType;
using someip::ReturnCode;

/// After a device has answered something later, an answer to something before may still be on its way for
/// this long.
constexpr Duration settling = 30ms;

std::string ids_text(const sd::Entry& entry) {
  return fmt::format("service {:#06x}, instance {:#06x}, eventgroup {:#06x}", value(entry.service),
                     value(entry.instance), value(entry.eventgroup()));
}

}  // namespace

// --- Service discovery ------------------------------------------------------------------------------------

void Trial::send_sd(const SdStimulus& stimulus, bool multicast, const char* what) {
  const Endpoint to = multicast ? tester.sd_group() : Endpoint{profile.device, profile.sd_port};
  const SdSessions::Next next = sessions.next(to);
  tester.send_sd(stimulus.encode(next.session, next.reboot), to);
  if (std::string_view{what} == check) {
    comment(&tester.packets().back(), what);
  } else {
    is_stimulus(what);
  }
  asked_all_ = asked_all_ || (multicast && std::ranges::any_of(stimulus.entries, [](const sd::Entry& one) {
                                return one.type == sd::EntryType::find_service;
                              }));
}

void Trial::is_stimulus(const std::string& what) {
  stimulus_ = &tester.packets().back();
  comment(stimulus_, what);
}

bool Trial::ask(const std::function<void()>& send, Duration within, const std::function<bool()>& done) {
  for (int count = 1; count <= tries; ++count) {
    retries_ += count == 1 ? 0 : 1;
    send();
    if (tester.receive(within, done)) {
      most_asked_ = std::max(most_asked_, count);
      return true;
    }
  }
  unanswered_ = true;
  return false;
}

sd::Entry Trial::find_entry(const ServiceProfile& service) {
  return {.type = sd::EntryType::find_service,
          .service = service.service,
          .instance = service.instance,
          .major = sd::any_major,
          .ttl_s = 3,
          .tail = sd::any_minor};
}

SeenEntry Trial::offer(const ServiceProfile& service) {
  if (const auto cycle = profile.timing.cyclic_offer_delay; cycle && *cycle <= longest_cycle) {
    const std::size_t since = now();
    if (auto seen = await_entry(since, 3 * *cycle + profile.timing.answer_within, is_offer(service))) {
      comment(seen->packet, "the offer");
      return *seen;
    }
    missing(fmt::format("no offer of service {:#06x} instance {:#06x} in three cycles",
                        value(service.service), value(service.instance)),
            "an OfferService");
  }
  return answer_to_find(find_entry(service), true, service);
}

void Trial::await_unicast_answers() {
  const auto cycle = profile.timing.cyclic_offer_delay;
  if (!cycle || !profile.policy.multicast_find_answers) {
    return;
  }
  tester.receive(Duration{0}, [] { return false; });
  // The last one a cycle after the one before: others are answers, or of the repetition phase.
  std::optional<WallTime> before;
  std::optional<WallTime> cyclic;
  for (Packet& one : tester.packets()) {
    if (is_offer_by_multicast(one)) {
      if (before && one.time - *before > *cycle * 3 / 4) {
        cyclic = one.time;
      }
      before = one.time;
    }
  }
  const WallTime present = std::chrono::system_clock::now();
  if (cyclic && present - *cyclic < *cycle / 4) {
    return;
  }
  (void)await_entry(now(), 4 * *cycle, [&](const SeenEntry& seen) {
    if (!is_offer(profile.service())(seen) || seen.packet->to != tester.sd_group()) {
      return false;
    }
    const auto last = std::exchange(before, seen.packet->time);
    return last && seen.packet->time - *last > *cycle * 3 / 4;
  });
}

SeenEntry Trial::answer_to_find(const SdStimulus& find, bool multicast, const ServiceProfile& service) {
  await_unicast_answers();
  const std::size_t since = now();
  if (auto seen = asked_for(
          [&] {
            await_unicast_answers();
            send_sd(find, multicast, "FindService");
          },
          is_find_answer(service))) {
    return *seen;
  }
  for (const SeenEntry& seen : entries_since(since, is_offer(service))) {
    if (is_between_cycles(seen)) {
      comment(seen.packet, "the answer?");
      fail(
          "no offer by unicast in answer to FindService, but one by multicast; a device that is meant to "
          "answer so has policy: multicast_find_answers in its profile",
          "an OfferService by unicast", "one by multicast", seen.packet);
    }
  }
  missing("no offer in answer to FindService", "an OfferService");
}

const EventgroupProfile& Trial::eventgroup(bool (*is_one)(const EventgroupProfile&)) {
  const auto& groups = profile.service().eventgroups;
  const auto found = std::ranges::find_if(groups, is_one);
  if (found == groups.end()) {
    unsupported("no such eventgroup in the profile");
  }
  return *found;
}

SdStimulus Trial::subscribe(const ServiceProfile& service, someip::EventgroupId group,
                            std::vector<Bytes> endpoints, std::uint32_t ttl_s, std::uint8_t counter) {
  SdStimulus stimulus;
  stimulus.entries = {{.type = sd::EntryType::subscribe_eventgroup,
                       .first_run = {.index = 0, .count = static_cast<std::uint8_t>(endpoints.size())},
                       .service = service.service,
                       .instance = service.instance,
                       .major = service.major,
                       .ttl_s = ttl_s,
                       .tail = sd::Entry::eventgroup_tail(group, counter, false)}};
  stimulus.options = std::move(endpoints);
  // Whoever sets the flag for explicit initial data gets initial values only where the entry asks for them.
  stimulus.flags = sd::unicast_flag;
  return stimulus;
}

Bytes Trial::own_endpoint() {
  return endpoint_option(tester.local(udp()), Transport::udp);
}

SdStimulus Trial::subscribe(const EventgroupProfile& group, std::uint32_t ttl_s) {
  return subscribe(profile.service(), group.id, {own_endpoint()}, ttl_s);
}

SeenEntry Trial::answer_to(const SdStimulus& stimulus) {
  subscriptions_.push_back(stimulus);
  // Where the ids of the answer are wrong, a case wants to say so; only the type has to be right.
  if (auto seen = asked_for(
          [&] { send_sd(stimulus); },
          [](const SeenEntry& one) { return one.entry.type == sd::EntryType::subscribe_eventgroup_ack; })) {
    return *seen;
  }
  missing("no answer to SubscribeEventgroup", "a SubscribeEventgroupAck");
}

std::optional<SeenEntry> Trial::asked_for(const std::function<void()>& send, const EntryIs& wanted) {
  const std::size_t since = now();
  std::vector<SeenEntry> found;
  if (!ask(send, [&] {
        found = entries_since(since, wanted);
        return !found.empty();
      })) {
    return std::nullopt;
  }
  comment(found.front().packet, "the answer");
  return found.front();
}

SeenEntry Trial::acknowledged(const SdStimulus& stimulus) {
  subscriptions_.push_back(stimulus);
  const std::size_t since = now();
  const EntryIs is_own = is_answer_to(stimulus.entries.front());
  if (auto seen = asked_for([&] { send_sd(stimulus); }, is_own)) {
    if (seen->entry.ttl_s == 0) {
      fail("the subscription is refused (SubscribeEventgroupNack)", "a SubscribeEventgroupAck",
           "a SubscribeEventgroupNack", seen->packet);
    }
    return *seen;
  }
  // Late answers to what was sent before are not meant; but where nothing else came, they may tell what is
  // wrong.
  const auto others = entries_since(since, [](const SeenEntry& seen) {
    return seen.entry.type == sd::EntryType::subscribe_eventgroup_ack;
  });
  if (!others.empty()) {
    const SeenEntry& other = others.front();
    fail("the acknowledgement is of another eventgroup, service or instance",
         "one of " + ids_text(stimulus.entries.front()), "one of " + ids_text(other.entry), other.packet);
  }
  missing("no answer to SubscribeEventgroup", "a SubscribeEventgroupAck");
}

std::optional<SeenEntry> Trial::not_acknowledged(const SdStimulus& stimulus) {
  subscriptions_.push_back(stimulus);
  const std::size_t since = now();
  send_sd(stimulus);
  pass();
  const auto answers = entries_since(since, [](const SeenEntry& seen) {
    return seen.entry.type == sd::EntryType::subscribe_eventgroup_ack;
  });
  for (const SeenEntry& seen : answers) {
    require(seen.entry.ttl_s == 0, "answer", "SubscribeEventgroupNack, or none", "SubscribeEventgroupAck",
            seen.packet);
  }
  return answers.empty() ? std::nullopt : std::optional{answers.front()};
}

void Trial::unsubscribe(SdStimulus stimulus) {
  for (sd::Entry& entry : stimulus.entries) {
    entry.ttl_s = 0;
  }
  send_sd(stimulus, false, "StopSubscribeEventgroup");
}

SdStimulus Trial::offer_of(const UsedService& used, std::vector<Bytes> endpoints, std::uint32_t ttl_s) {
  SdStimulus message;
  message.entries = {{.type = sd::EntryType::offer_service,
                      .first_run = {.index = 0, .count = static_cast<std::uint8_t>(endpoints.size())},
                      .service = used.service,
                      .instance = used.instance,
                      .major = used.major,
                      .ttl_s = ttl_s,
                      .tail = 0}};
  message.options = std::move(endpoints);
  return message;
}

void Trial::offer_ours(const SdStimulus& offer) {
  offers_.push_back(offer);
  send_sd(offer, true, "OfferService");
}

void Trial::withdraw(SdStimulus offer) {
  for (sd::Entry& entry : offer.entries) {
    entry.ttl_s = 0;
  }
  send_sd(offer, true, "StopOfferService");
}

// --- Calls and events -------------------------------------------------------------------------------------

PortId Trial::udp() {
  if (!udp_) {
    udp_ = tester.open_udp();
  }
  return *udp_;
}

PortId Trial::tcp() {
  if (!tcp_ || tester.is_closed(*tcp_)) {
    tcp_ = tester.connect(tcp_of(profile.service()), profile.timing.answer_within);
    if (!tcp_) {
      missing("no TCP connection to the offered port", "a TCP connection");
    }
  }
  return *tcp_;
}

Endpoint Trial::udp_of(const ServiceProfile& service) const {
  return {profile.device, service.udp_port.value_or(0)};
}

Endpoint Trial::tcp_of(const ServiceProfile& service) const {
  return {profile.device, service.tcp_port.value_or(0)};
}

Call Trial::request(const ServiceProfile& service) const {
  Call call{.service = service.service, .interface_version = service.major};
  if (service.request) {
    call.method = service.request->method;
    call.payload = service.request->payload;
  }
  return call;
}

Call Trial::call(someip::MethodId method, Bytes payload) const {
  return {.service = profile.service().service,
          .method = method,
          .payload = std::move(payload),
          .interface_version = profile.service().major};
}

Call Trial::send(Call call) {
  const bool over_tcp = call.transport == Transport::tcp;
  return send(std::move(call), over_tcp ? tcp_of(profile.service()) : udp_of(profile.service()),
              over_tcp ? tcp() : udp());
}

Call Trial::send(Call call, const Endpoint& to, PortId from) {
  if (call.session == someip::SessionId{}) {
    session_ = session_ == 0xffff ? std::uint16_t{1} : static_cast<std::uint16_t>(session_ + 1);
    call.session = someip::SessionId{session_};
  }
  if (call.transport == Transport::tcp) {
    tester.send(from, call.encode());
  } else {
    tester.send(from, call.encode(), to);
  }
  is_stimulus();
  return call;
}

SeenMessage Trial::answer_to(Call call) {
  const std::size_t since = now();
  if (auto seen = answer_if_any(call)) {
    return *seen;
  }
  if (call.transport == Transport::tcp) {
    must_be_open(since);
  }
  missing("no answer to the request", "a response");
}

void Trial::must_be_open(std::size_t since) {
  std::string broken;
  for (std::size_t at = since; at < tester.packets().size(); ++at) {
    Packet& packet = tester.packets()[at];
    if (packet.sent || packet.transport != Transport::tcp) {
      continue;
    }
    if (packet.ends) {
      fail("no answer to the request: the device has ended the connection", "a response",
           broken + "the end of the connection", &packet);
    }
    if (!someip::decode(packet.bytes)) {
      broken =
          fmt::format("{} bytes that are no message ({}), then ", packet.bytes.size(), hex(packet.bytes));
    }
  }
}

std::optional<SeenMessage> Trial::answer_if_any(Call call) {
  const std::size_t since = now();
  Call sent;
  std::vector<SeenMessage> found;
  const auto has_come = [&] {
    // An answer with a wrong Request ID is an answer, too: the port is this trial's own.
    found = messages_since(since, [&](const SeenMessage& one) {
      return is_answer_to(sent)(one) || (one.message.header.type != MessageType::notification &&
                                         one.message.header.service == call.service);
    });
    return !found.empty();
  };
  if (call.transport == Transport::tcp) {
    sent = send(call);
    tester.receive(profile.timing.answer_within,
                   [&] { return has_come() || (tcp_ && tester.is_closed(*tcp_)); });
  } else {
    ask([&] { sent = send(call); }, has_come);
  }
  if (found.empty()) {
    return std::nullopt;
  }
  const SeenMessage& seen = found.front();
  comment(seen.packet, "the answer");
  equal("Client ID", value(sent.client), value(seen.message.header.client), seen.packet);
  equal("Session ID", value(sent.session), value(seen.message.header.session), seen.packet);
  return seen;
}

SeenMessage Trial::answer_from(const ServiceProfile& service, const std::string& who) {
  const std::size_t since = now();
  std::vector<SeenMessage> found;
  Call sent;
  if (!ask([&] { sent = send(request(service), udp_of(service), udp()); },
           [&] {
             found = messages_since(since, is_answer_to(sent));
             return !found.empty();
           })) {
    missing("no answer from " + who, "a response");
  }
  return found.front();
}

SeenMessage Trial::good_answer_to(const Call& call) {
  const SeenMessage seen = answer_to(call);
  const someip::Header& header = seen.message.header;
  equal("Message Type", MessageType::response, someip::without_tp(header.type), seen.packet);
  equal("Return Code", ReturnCode::ok, header.return_code, seen.packet);
  equal("Service ID", value(call.service), value(header.service), seen.packet);
  equal("Method ID", value(call.method), value(header.method), seen.packet);
  equal("Protocol Version", someip::protocol_version, header.protocol, seen.packet);
  equal("Interface Version", call.interface_version, header.interface_version, seen.packet);
  return seen;
}

SeenMessage Trial::error_answer_to(const Call& call, std::optional<ReturnCode> code) {
  if (auto seen = error_answer_if_any(call, code)) {
    return *seen;
  }
  missing("no answer to the request", "an error");
}

std::optional<SeenMessage> Trial::error_answer_if_any(const Call& call, std::optional<ReturnCode> code) {
  const auto answer = answer_if_any(call);
  if (!answer) {
    return std::nullopt;
  }
  const SeenMessage& seen = *answer;
  const someip::Header& header = seen.message.header;
  const ErrorType wanted = profile.policy.error_type;
  const bool good_type = (header.type == MessageType::response && wanted != ErrorType::error) ||
                         (header.type == MessageType::error && wanted != ErrorType::response);
  require(good_type, "Message Type", "that of an error", text(header.type), seen.packet);
  require(header.return_code != ReturnCode::ok, "Return Code", "an error", text(header.return_code),
          seen.packet);
  if (code) {
    equal("Return Code", *code, header.return_code, seen.packet);
  }
  return answer;
}

std::vector<SeenMessage> Trial::answers_once_passed(const Call& call) {
  const std::size_t since = now();
  const Call sent = send(call);
  pass();
  return messages_since(since, is_answer_to(sent));
}

std::optional<SeenMessage> Trial::not_served(const Call& call) {
  const auto answers = answers_once_passed(call);
  for (const SeenMessage& seen : answers) {
    require(
        seen.message.header.return_code != ReturnCode::ok || seen.message.header.type == MessageType::error,
        "answer", "an error, or none", "a response with E_OK", seen.packet);
  }
  return answers.empty() ? std::nullopt : std::optional{answers.front()};
}

void Trial::not_answered(const Call& call) {
  for (const SeenMessage& seen : answers_once_passed(call)) {
    different("answer", "none",
              text(seen.message.header.type) + " with code " + text(seen.message.header.return_code),
              seen.packet);
  }
}

void Trial::send_bytes(ByteView datagram) {
  tester.send(udp(), datagram, udp_of(profile.service()));
  is_stimulus();
}

void Trial::send_bytes(PortId connection, ByteView bytes) {
  tester.send(connection, bytes);
  is_stimulus();
}

void Trial::pass() {
  if (profile.services.empty()) {
    // Whatever it would answer to changes what it does next.
    tester.receive(profile.timing.answer_within, [] { return false; });
    return;
  }
  if (!alive()) {
    missing("the device does not answer any more", "an answer to a Find, and to the request of the profile");
  }
  tester.receive(settling, [] { return false; });
}

std::vector<SeenMessage> Trial::initial_values(const std::vector<someip::MethodId>& events,
                                               const std::function<void()>& subscribe) {
  std::size_t since = 0;
  std::vector<SeenMessage> found;
  const auto have_come = [&] {
    found.clear();
    for (const someip::MethodId one : events) {
      if (const auto seen = messages_since(since, is_event(one)); !seen.empty()) {
        found.push_back(seen.front());
      }
    }
    return found.size() == events.size();
  };
  const auto begin = [&] {
    since = now();
    subscribe();
  };
  if (!ask(begin, have_come)) {
    missing(fmt::format("{} of {} initial values come", found.size(), events.size()),
            fmt::format("event {:#06x}", value(*std::ranges::find_if(events, [&](someip::MethodId one) {
                          return messages_since(since, is_event(one)).empty();
                        }))));
  }
  for (const SeenMessage& seen : found) {
    comment(seen.packet, "the event");
  }
  return found;
}

std::vector<SeenMessage> Trial::initial_values(const std::vector<someip::MethodId>& events,
                                               const SdStimulus& subscribe) {
  bool is_subscribed = false;
  return initial_values(events, [&] {
    if (std::exchange(is_subscribed, true)) {
      unsubscribe(subscribe);
      pass();  // whatever it says to that is no answer to what follows
    }
    acknowledged(subscribe);
  });
}

EventSource Trial::source() {
  if (const auto one = event_source(profile)) {
    return *one;
  }
  unsupported("no event in the profile that can be waited for");
}

SdStimulus Trial::subscribe(const EventSource& source, std::uint32_t ttl_s) {
  return subscribe(profile.service(), source.group, {own_endpoint()}, ttl_s);
}

void Trial::ask_for(const EventSource& source) {
  if (source.trigger) {
    Call trigger = call(*source.trigger);
    trigger.type = MessageType::request_no_return;
    send(trigger);
  }
}

bool Trial::ask_for(const EventSource& source, const std::function<bool()>& done) {
  const Duration within = 2 * source.cycle + 2 * profile.timing.answer_within;
  return source.trigger ? ask([&] { ask_for(source); }, within, done) : tester.receive(within, done);
}

std::vector<SeenMessage> Trial::all_events(const EventSource& source) {
  const std::size_t since = now();
  ask_for(source);
  tester.receive(2 * source.cycle, [] { return false; });
  pass();
  return messages_since(since, is_event(source.event));
}

SeenMessage Trial::event(const EventSource& source, std::optional<Endpoint> to) {
  const std::size_t since = now();
  std::vector<SeenMessage> found;
  const auto has_come = [&] {
    found = messages_since(since, [&](const SeenMessage& seen) {
      return is_event(source.event)(seen) && (!to || seen.packet->to == *to);
    });
    return !found.empty();
  };
  if (ask_for(source, has_come)) {
    comment(found.front().packet, "the event");
    return found.front();
  }
  missing(fmt::format("event {:#06x} does not come", value(source.event)),
          fmt::format("event {:#06x}", value(source.event)));
}

}  // namespace trestle::conform
