#include "bridge/conform/trial.hpp"

#include <algorithm>
#include <utility>

#include "bridge/conform/device.hpp"
#include "bridge/documents/hex_line.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using someip::MessageType;
using someip::ReturnCode;

constexpr int tries = 3;
/// What the evidence says of messages that no case has asked for.
constexpr const char* check = "check: is the device there?";
/// Offers that come more seldom are not waited for.
constexpr Duration longest_cycle = 5s;
/// After a device has answered something later, an answer to something before may still be on its way for
/// this long.
constexpr Duration settling = 30ms;
/// What was asked by multicast is answered after a time that is drawn at random, and must not look like an
/// answer to what the next case asks.
constexpr Duration response_delay = 50ms;

std::string ids_text(const sd::Entry& entry) {
  return fmt::format("service {:#06x}, instance {:#06x}, eventgroup {:#06x}", value(entry.service),
                     value(entry.instance), value(entry.eventgroup()));
}

}  // namespace

std::string hex(ByteView bytes) {
  std::string all;
  for (const std::byte one : bytes.first(std::min<std::size_t>(bytes.size(), 32))) {
    all += fmt::format("{}{:02x}", all.empty() ? "" : " ", std::to_integer<unsigned>(one));
  }
  return all + (bytes.size() > 32 ? fmt::format(" ... ({} bytes)", bytes.size()) : "");
}

std::vector<sd::Option> SeenEntry::options() const {
  std::vector<sd::Option> all;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    if (const auto option = message.option_of(entry, position)) {
      all.push_back(*option);
    }
  }
  return all;
}

std::vector<sd::EndpointOption> SeenEntry::endpoints(sd::EndpointRole role) const {
  std::vector<sd::EndpointOption> all;
  for (const sd::Option& option : options()) {
    if (const auto endpoint = sd::EndpointOption::decode(option); endpoint && endpoint->role == role) {
      all.push_back(*endpoint);
    }
  }
  return all;
}

SdSessions::Next SdSessions::next(const Endpoint& to) {
  Relation& relation = relations_[to];
  if (++relation.session == 0) {
    relation.session = 1;
    relation.wrapped = true;
  }
  return {someip::SessionId{relation.session}, !relation.wrapped};
}

Trial::Trial(const Profile& the_profile, Tester& the_tester, Device& the_device, SdSessions& the_sessions)
    : profile{the_profile},
      tester{the_tester},
      device{the_device},
      sessions{the_sessions},
      requests_{the_profile.service().request && the_profile.service().udp_port} {}

void Trial::begin(std::uint64_t seed, const std::string& id) {
  std::vector<std::uint32_t> numbers(id.begin(), id.end());
  numbers.push_back(static_cast<std::uint32_t>(seed));
  numbers.push_back(static_cast<std::uint32_t>(seed >> 32U));
  std::seed_seq mixed(numbers.begin(), numbers.end());
  random.seed(mixed);
  session_ = static_cast<std::uint16_t>(random());
}

// --- Judging ----------------------------------------------------------------------------------------------

void Trial::comment(Packet* packet, const std::string& text) {
  if (packet != nullptr) {
    packet->comment += (packet->comment.empty() ? "" : "; ") + text;
  }
}

void Trial::different(const std::string& field, const std::string& expected, const std::string& actual,
                      Packet* packet) {
  differences_.push_back({field, expected, actual, packet == nullptr ? 0 : packet->number});
  comment(packet, fmt::format("OFFENDING: {} is {}, expected {}", field, actual, expected));
}

void Trial::fail(const std::string& reason, const std::string& expected, const std::string& actual,
                 Packet* packet) {
  comment(packet, fmt::format("OFFENDING: {}: {}, expected {}", reason, actual, expected));
  throw Ended{Verdict::fail,
              reason,
              {{.field = "message",
                .expected = expected,
                .actual = actual,
                .packet = packet == nullptr ? 0 : packet->number}}};
}

void Trial::missing(const std::string& reason, const std::string& expected) {
  tester.receive_now();
  Packet* packet = stimulus_;
  if (packet != nullptr) {
    const auto waited = std::chrono::system_clock::now() - packet->time;
    comment(packet, fmt::format("OFFENDING: no answer to this within {:.1f} s, expected {}",
                                std::chrono::duration<double>(waited).count(), expected));
  } else if (!tester.packets().empty()) {
    packet = &tester.packets().back();
    comment(packet, fmt::format("OFFENDING: up to here {}, expected {}", reason, expected));
  }
  throw Ended{Verdict::fail,
              reason,
              {{.field = "message",
                .expected = expected,
                .actual = "nothing",
                .packet = packet == nullptr ? 0 : packet->number}}};
}

void Trial::unsupported(const std::string& reason) {
  throw Ended{Verdict::unsupported, reason};
}

void Trial::inconclusive(const std::string& reason) {
  throw Ended{Verdict::inconclusive, reason};
}

Attempt Trial::attempt() const {
  Attempt attempt{
      .differences = differences_, .retries = retries_, .stalled = tester.stalled() > Duration{0}};
  if (retries_ > 0) {
    const char* const which = unanswered_ ? "none" : most_asked_ == 2 ? "the 2nd" : "the 3rd";
    attempt.retried = fmt::format("answered {} of {} requests", which, tries);
  }
  if (!differences_.empty()) {
    const Difference& first = differences_.front();
    attempt.verdict = Verdict::fail;
    attempt.reason = fmt::format("{} is {}, expected {}", first.field, first.actual, first.expected);
  } else if (!nonstrict_.empty()) {
    attempt.verdict = Verdict::pass_nonstrict;
    attempt.reason = nonstrict_;
  }
  return attempt;
}

// --- Service discovery ------------------------------------------------------------------------------------

bool Trial::is_sd(const Packet& packet) const {
  return packet.to == tester.sd() || packet.to == tester.sd_group() ||
         std::ranges::find(sd_endpoints_, packet.to) != sd_endpoints_.end();
}

std::vector<SeenEntry> Trial::entries_since(std::size_t since, const EntryIs& wanted) {
  std::vector<SeenEntry> all;
  for (std::size_t at = since; at < tester.packets().size(); ++at) {
    std::ranges::copy_if(entries_of(tester.packets()[at]), std::back_inserter(all), wanted);
  }
  return all;
}

std::vector<SeenEntry> Trial::entries_of(Packet& packet) const {
  std::vector<SeenEntry> all;
  if (packet.sent || packet.from.address != profile.device || !is_sd(packet)) {
    return all;
  }
  for (someip::MessageCursor cursor{packet.bytes}; const auto message = cursor.next();) {
    // Message ID alone: what else is wrong in the header, a case is to find.
    if (value(message->header.service) != 0xffff || value(message->header.method) != 0x8100) {
      continue;
    }
    const auto decoded = sd::decode(message->payload);
    for (std::size_t index = 0; decoded && index < decoded->entry_count(); ++index) {
      all.push_back({&packet, message->header, *decoded, decoded->entry(index)});
    }
  }
  return all;
}

std::optional<SeenEntry> Trial::await_entry(std::size_t since, Duration within, const EntryIs& wanted) {
  std::vector<SeenEntry> found;
  tester.receive(within, [&] {
    found = entries_since(since, wanted);
    return !found.empty();
  });
  return found.empty() ? std::nullopt : std::optional{found.front()};
}

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

Trial::EntryIs Trial::is_offer(const ServiceProfile& service) {
  return [&service](const SeenEntry& seen) {
    return seen.entry.kind() == sd::EntryKind::offer_service && seen.entry.service == service.service &&
           seen.entry.instance == service.instance;
  };
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

Trial::EntryIs Trial::is_find_answer(const ServiceProfile& service) {
  return [this, is_one = is_offer(service)](const SeenEntry& seen) {
    // A cyclic offer at the same moment is no answer.
    return is_one(seen) && (seen.packet->to == tester.sd() ||
                            (profile.policy.multicast_find_answers &&
                             (!profile.timing.cyclic_offer_delay || is_between_cycles(seen))));
  };
}

bool Trial::is_offer_by_multicast(Packet& packet) {
  return !packet.sent && packet.to == tester.sd_group() &&
         std::ranges::any_of(entries_of(packet), is_offer(profile.service()));
}

std::optional<WallTime> Trial::last_offer_by_multicast(WallTime before) {
  auto& packets = tester.packets();
  const auto last = std::find_if(packets.rbegin(), packets.rend(), [&](Packet& one) {
    return one.time < before && is_offer_by_multicast(one);
  });
  return last != packets.rend() ? std::optional{last->time} : std::nullopt;
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

bool Trial::is_between_cycles(const SeenEntry& seen) {
  const auto cycle = profile.timing.cyclic_offer_delay;
  if (!cycle || seen.packet->to != tester.sd_group()) {
    return false;
  }
  const auto before = last_offer_by_multicast(seen.packet->time);
  return before && seen.packet->time - *before < *cycle * 3 / 4;
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

Trial::EntryIs Trial::is_answer_to(const sd::Entry& subscribe) {
  return [subscribe](const SeenEntry& seen) {
    return seen.entry.type == sd::EntryType::subscribe_eventgroup_ack &&
           seen.entry.service == subscribe.service && seen.entry.instance == subscribe.instance &&
           seen.entry.eventgroup() == subscribe.eventgroup();
  };
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

std::vector<SeenMessage> Trial::messages_since(std::size_t since, const MessageIs& wanted) {
  std::vector<SeenMessage> all;
  for (std::size_t at = since; at < tester.packets().size(); ++at) {
    Packet& packet = tester.packets()[at];
    if (packet.sent || packet.from.address != profile.device || is_sd(packet)) {
      continue;
    }
    for (someip::MessageCursor cursor{packet.bytes}; const auto message = cursor.next();) {
      const SeenMessage seen{&packet, *message};
      if (wanted(seen)) {
        all.push_back(seen);
      }
    }
  }
  return all;
}

std::optional<SeenMessage> Trial::await_message(std::size_t since, Duration within, const MessageIs& wanted) {
  std::vector<SeenMessage> found;
  tester.receive(within, [&] {
    found = messages_since(since, wanted);
    return !found.empty();
  });
  return found.empty() ? std::nullopt : std::optional{found.front()};
}

Trial::MessageIs Trial::is_answer_to(const Call& call) {
  return [call](const SeenMessage& seen) {
    const auto type = someip::without_tp(seen.message.header.type);
    return seen.message.header.client == call.client && seen.message.header.session == call.session &&
           (type == MessageType::response || type == MessageType::error);
  };
}

Trial::MessageIs Trial::is_event(someip::MethodId event) const {
  return [event, service = profile.service().service](const SeenMessage& seen) {
    return seen.message.header.service == service && seen.message.header.method == event &&
           someip::without_tp(seen.message.header.type) == MessageType::notification;
  };
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

SeenMessage Trial::event(someip::MethodId event, std::size_t since) {
  if (auto seen = await_message(since, profile.timing.answer_within * 2, is_event(event))) {
    comment(seen->packet, "the event");
    return *seen;
  }
  missing(fmt::format("event {:#06x} does not come", value(event)),
          fmt::format("event {:#06x}", value(event)));
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

std::vector<SeenMessage> Trial::all_events(const EventSource& source) {
  const std::size_t since = now();
  ask_for(source);
  tester.receive(2 * source.cycle, [] { return false; });
  pass();
  return messages_since(since, is_event(source.event));
}

SeenMessage Trial::event(const EventSource& source) {
  const std::size_t since = now();
  const Duration within = 2 * source.cycle + profile.timing.answer_within * 2;
  std::vector<SeenMessage> found;
  const auto has_come = [&] {
    found = messages_since(since, is_event(source.event));
    return !found.empty();
  };
  // One that comes by itself cannot be asked for again.
  if (source.trigger ? ask([&] { ask_for(source); }, within, has_come) : tester.receive(within, has_come)) {
    comment(found.front().packet, "the event");
    return found.front();
  }
  missing(fmt::format("event {:#06x} does not come", value(source.event)),
          fmt::format("event {:#06x}", value(source.event)));
}

bool Trial::answers_find() {
  for (int count = 0; count < tries; ++count) {
    const std::size_t since = now();
    send_sd({.entries = {find_entry(profile.service())}}, false, check);
    // By an offer of the service: an entry of another type may be a late answer to what a case has sent.
    // Which other fields are right is for the cases.
    if (await_entry(since, profile.timing.answer_within, [this](const SeenEntry& seen) {
          return (seen.packet->to == tester.sd() || profile.policy.multicast_find_answers ||
                  is_between_cycles(seen)) &&
                 seen.entry.kind() == sd::EntryKind::offer_service &&
                 seen.entry.service == profile.service().service;
        })) {
      return true;
    }
  }
  return false;
}

bool Trial::answers_request() {
  // It is no stimulus of a case.
  Packet* const before = stimulus_;
  for (int count = 0; count < tries; ++count) {
    const std::size_t since = now();
    Call call = request();
    call.client = someip::ClientId{0x5aff};
    call = send(call);
    tester.packets().back().comment = check;
    stimulus_ = before;
    if (await_message(since, profile.timing.answer_within, [&](const SeenMessage& seen) {
          return seen.message.header.service == call.service || is_answer_to(call)(seen);
        })) {
      return true;
    }
  }
  return false;
}

bool Trial::offers_by_itself() {
  const auto cycle = profile.timing.cyclic_offer_delay;
  return cycle && *cycle > Duration{0} && *cycle <= longest_cycle &&
         await_entry(now(), 3 * *cycle + profile.timing.answer_within, is_offer(profile.service()))
             .has_value();
}

bool Trial::subscribes() {
  const UsedService& used = profile.used_by_itself();
  const SdStimulus offer = offer_of(used, {own_endpoint()});
  Packet* const before = stimulus_;
  for (int count = 0; count < tries; ++count) {
    const std::size_t since = now();
    send_sd(offer, true, check);
    const auto seen = await_entry(since, profile.timing.answer_within, [&](const SeenEntry& one) {
      return one.entry.kind() == sd::EntryKind::subscribe_eventgroup && one.entry.service == used.service;
    });
    withdraw(offer);
    stimulus_ = before;
    if (seen) {
      return true;
    }
  }
  return false;
}

bool Trial::is_there() {
  if (profile.services.empty()) {
    return subscribes();
  }
  finds_ = answers_find();
  requests_ = requests_ && answers_request();
  offers_only_ = !finds_ && !requests_ && offers_by_itself();
  return finds_ || requests_ || offers_only_;
}

bool Trial::alive() {
  if (profile.services.empty()) {
    return subscribes();
  }
  return (!finds_ || answers_find()) && (!requests_ || answers_request()) &&
         (!offers_only_ || offers_by_itself());
}

void Trial::close_ports() {
  tester.close_all();
  udp_.reset();
  tcp_.reset();
}

void Trial::clean_up() {
  for (const SdStimulus& subscription : subscriptions_) {
    if (!subscription.length && !subscription.entries_length && !subscription.options_length) {
      unsubscribe(subscription);
    }
  }
  subscriptions_.clear();
  // One is enough, as all are of the same service.
  if (!offers_.empty()) {
    withdraw(offers_.front());
  }
  offers_.clear();
  if (std::exchange(asked_all_, false)) {
    tester.receive(response_delay, [] { return false; });
  }
  close_ports();
}

std::optional<SdSign> Trial::sign_of(Packet& packet) const {
  std::optional<SdSign> sign;
  for (const SeenEntry& seen : entries_of(packet)) {
    sign = sign.value_or(SdSign{.time = packet.time,
                                .multicast = packet.to == tester.sd_group(),
                                .session = seen.header.session,
                                .reboot = seen.message.reboot()});
    sign->offers = sign->offers || is_start()(seen);
  }
  return sign;
}

Trial::EntryIs Trial::is_start() const {
  if (!profile.services.empty()) {
    return is_offer(profile.service());
  }
  return [&used = profile.used_by_itself()](const SeenEntry& seen) {
    return seen.entry.kind() == sd::EntryKind::find_service && seen.entry.service == used.service;
  };
}

std::size_t Trial::restart(bool at_once) {
  const Duration within = profile.timing.ready_within;
  std::size_t since = now();
  if (!profile.lifecycle.restart.empty() || profile.lifecycle.ask_operator) {
    // What it said before stands in what was received, too: its messages have to tell where they begin anew.
    NewLife life{std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now()),
                 longest_pause(profile.timing)};
    device.restart(at_once);
    std::optional<std::size_t> begin;
    std::size_t next = 0;
    tester.receive(within, [&] {
      bool started = false;
      for (; next < tester.packets().size(); ++next) {
        if (const auto sign = sign_of(tester.packets()[next]); sign && next < since) {
          life.before(*sign);
        } else if (sign) {
          begin = !begin && life.begins_with(*sign) ? std::optional{next} : begin;
          started = started || (begin && sign->offers);
        }
      }
      return started;
    });
    // One that shows nothing of it is judged by all that it has said since.
    since = begin.value_or(since);
  } else {
    device.stop(at_once);
    since = now();  // what it said before is of its life before
    device.start();
    (void)await_entry(since, within,
                      [&](const SeenEntry& seen) { return is_start()(seen) && seen.message.reboot(); });
  }
  if (entries_since(since, is_start()).empty()) {
    missing(profile.services.empty()
                ? "the device does not look for the service that it uses after it was started"
                : "the device does not offer its service after it was started",
            profile.services.empty() ? "a FindService" : "an OfferService");
  }
  return since;
}

}  // namespace trestle::conform
