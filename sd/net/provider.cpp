#include "sd/net/provider.hpp"

#include <algorithm>
#include <random>
#include <stdexcept>

#include "sd/core/receive_buffer.hpp"
#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"
#include "someip/wire/slices.hpp"

namespace trestle::sd {

using someip::Header;
using someip::Message;
using someip::MessageType;
using someip::MethodId;
using someip::MethodKind;
using someip::ReturnCode;

namespace {

constexpr std::size_t max_slow = 32;                       // slow subscribers that are remembered
constexpr Duration slow_pause = std::chrono::seconds{10};  // from one line about one of them to the next

bool contains(const std::vector<MethodId>& ids, MethodId id) {
  return std::ranges::find(ids, id) != ids.end();
}

std::vector<std::byte> joined(std::span<const ByteView> slices) {
  std::vector<std::byte> all;
  all.reserve(size_of(slices));
  for (const ByteView slice : slices) {
    all.insert(all.end(), slice.begin(), slice.end());
  }
  return all;
}

/// Whether a payload of this size may go over UDP: large ones only if they may be segmented.
/// [feat_req_someiptp_788]
bool may_be_sent(const ServiceSpec& spec, MethodId id, std::size_t bytes) {
  return bytes <= someip::max_plain_payload_bytes || !spec.segmented || contains(*spec.segmented, id);
}

/// Whether its description says so, and not only leaves it open.
bool takes_large_requests(const ServiceSpec& spec) {
  const auto listed = [&spec](const auto& method) { return contains(*spec.segmented, method); };
  return spec.segmented && (std::ranges::any_of(spec.methods, listed, &MethodSpec::id) ||
                            std::ranges::any_of(spec.fields, [&](const FieldSpec& field) {
                              return field.setter && listed(*field.setter);
                            }));
}

}  // namespace

Provider::Provider(boost::asio::io_context& io, ServiceDiscovery& discovery, Ports& ports,
                   const NodeConfig& config, NodeCounters& counters, AccessGuard& access, DiscoveryLog log,
                   DiscoveryLog warn)
    : discovery_{discovery},
      ports_{ports},
      config_{config},
      counters_{counters},
      access_{access},
      unproven_{config.unproven_answer_bytes, config.unproven_answer_rate, std::random_device{}()},
      repeated_{config.max_repeated_values, std::random_device{}()},
      may_be_sent_{[this](const Endpoint& to, std::size_t bytes) { return may_receive(to, bytes); }},
      not_there_{[this](const IpAddress& to) { say_who_is_silent(to); }},
      log_{std::move(log)},
      warn_{std::move(warn)},
      cycle_{io, [this] { send_cyclic_values(); }} {}

// --- Offers -----------------------------------------------------------------------------------------------

OfferHandle Provider::offer(ServiceSpec spec, TimePoint now) {
  const std::string name = "offer of " + to_string(spec.service, spec.instance);
  if (const std::string mistake = mistake_in(spec, config_); !mistake.empty()) {
    throw std::invalid_argument{name + ": " + mistake};
  }
  E2eChannels e2e;
  try {
    e2e = channels_of(spec);
  } catch (const std::invalid_argument& mistake) {
    throw std::invalid_argument{name + ": " + mistake.what()};
  }
  // Only the endpoint tells which instance a message is for.  [feat_req_someip_445] [feat_req_someip_967]
  const auto usable = [&](const auto& port) {
    return std::ranges::none_of(offers_, [&](const auto& other) {
      const void* const at = &port;
      return (other->udp.get() == at || other->tcp.get() == at) && other->spec.service == spec.service &&
             other->spec.instance != spec.instance;
    });
  };
  const auto offer = std::make_shared<OpenOffer>();
  if (spec.udp_port) {
    offer->udp = ports_.udp(*spec.udp_port, usable);
  }
  if (spec.tcp_port) {
    offer->tcp = ports_.tcp(*spec.tcp_port, usable);
  }
  std::vector<Eventgroup> groups;
  for (const EventgroupSpec& group : spec.eventgroups) {
    groups.push_back(eventgroup_of(spec, group));
  }
  OfferedService offered{.service = spec.service,
                         .instance = spec.instance,
                         .major = spec.major,
                         .minor = spec.minor,
                         .eventgroups = groups,
                         .ttl_s = spec.ttl_s};
  std::vector<ConfigurationItem> configuration;
  for (const ConfigurationText& item : spec.configuration) {
    configuration.push_back({item.key, item.value});
  }
  std::string room;
  if (offer->udp && config_.discovery.tell_receive_buffer && configuration.empty() &&
      takes_large_requests(spec)) {
    room = std::to_string(offer->udp->socket.receive_buffer_bytes());
    configuration.push_back({receive_buffer_key, room});
  }
  offered.configuration = configuration;
  offered.options = spec.options;
  std::string at;
  if (offer->udp) {
    offered.udp = offer->udp->socket.local();
    at += " at UDP " + someip::to_string(*offered.udp);
  }
  if (offer->tcp) {
    offered.tcp = offer->tcp->server.local();
    at += " at TCP " + someip::to_string(*offered.tcp);
  }
  const auto handle = discovery_.offer(offered, now);
  if (!handle) {
    throw std::invalid_argument{
        name + ": refused by service discovery: " +
        refusal_text(handle.error(), "max_offers, max_eventgroups, max_configurations")};
  }
  offer->handle = *handle;
  offer->e2e = std::move(e2e);
  for (const EventgroupSpec& group : spec.eventgroups) {
    for (const Endpoint& client : group.configured_subscribers) {
      if (const auto added = discovery_.add_subscriber(*handle, group.id, client); !added) {
        discovery_.stop_offer(*handle, now);
        throw std::invalid_argument{name + ": configured subscriber " + someip::to_string(client) + ": " +
                                    to_string(added.error())};
      }
    }
  }
  offer->values = values_of(spec, now);
  for (const EventWait& wait : spec.waits) {
    offer->events[wait.id].waits = wait.rule;
  }
  log_("offering " + to_string(spec.service, spec.instance) + at);
  for (const std::string& doubt : doubts_about(spec)) {
    log_(std::string{name}.append(": ").append(doubt));
  }
  if (spec.service != other_protocols) {  // those differ in their names
    offered_.insert(key_of(spec.service, spec.instance, spec.major));
  }
  offer->spec = std::move(spec);
  offers_.push_back(offer);
  arm_cycle();
  return *handle;
}

Eventgroup Provider::eventgroup_of(const ServiceSpec& spec, const EventgroupSpec& group) {
  const auto over = [&](Transport transport) {
    return [&spec, transport](MethodId event) { return transport_of(spec, event) == transport; };
  };
  const auto is_udp_notifier = [&](MethodId event) {
    return transport_of(spec, event) == Transport::udp &&
           std::ranges::any_of(spec.fields, [&](const FieldSpec& field) { return field.notifier == event; });
  };
  Eventgroup result{
      .id = group.id,
      .udp = group.events.empty() ? spec.udp_port.has_value()
                                  : std::ranges::any_of(group.events, over(Transport::udp)),
      .tcp = group.events.empty() ? !spec.udp_port : std::ranges::any_of(group.events, over(Transport::tcp))};
  if (result.udp && group.multicast && group.multicast_threshold != 0) {
    result.multicast = group.multicast;
    // Initial events are unicast also where all others are multicast.  [feat_req_someip_812]
    result.udp = group.multicast_threshold > 1 || std::ranges::any_of(group.events, is_udp_notifier);
  }
  return result;
}

void Provider::withdraw(OfferHandle handle, TimePoint now) {
  discovery_.stop_offer(handle, now);
  const auto found = std::ranges::find(offers_, handle, &OpenOffer::handle);
  if (found != offers_.end()) {
    const ServiceSpec& spec = (*found)->spec;
    offered_.erase(key_of(spec.service, spec.instance, spec.major));
    ports_.leave((*found)->tcp);
    offers_.erase(found);
    arm_cycle();
  }
}

void Provider::clear() {
  offers_.clear();
  offered_.clear();
  arm_cycle();
}

void Provider::note_rivals() {
  std::vector<RemoteService> rivals;
  discovery_.for_each_remote([&](const slots::Remote& remote) {
    if (offered_.contains(key_of(remote.service, remote.instance, remote.major))) {
      rivals.push_back(discovery_.service_of(remote));
    }
  });
  std::vector<RemoteHandle> handles(rivals.size());
  std::ranges::transform(rivals, handles.begin(), &RemoteService::handle);
  const std::vector<RemoteHandle> known = std::exchange(rivals_, std::move(handles));
  for (const RemoteService& rival : rivals) {
    if (std::ranges::find(known, rival.handle) == known.end()) {
      ++counters_.offered_twice;
      warn_(to_string(rival.service, rival.instance) + " version " + std::to_string(rival.major) +
            " is offered twice: by us, " + someip::to_string(config_.address) + ", and by " +
            someip::to_string(rival.peer.address) + " at " + endpoints_text(rival) +
            "; clients may use either");
    }
  }
}

std::shared_ptr<Provider::OpenOffer> Provider::find(OfferHandle handle) const {
  const auto found = std::ranges::find(offers_, handle, &OpenOffer::handle);
  return found == offers_.end() ? nullptr : *found;
}

// --- Events -----------------------------------------------------------------------------------------------

Transport Provider::transport_of(const ServiceSpec& spec, MethodId event) {
  return !spec.udp_port || contains(spec.tcp_events, event) ? Transport::tcp : Transport::udp;
}

// Also who subscribed to several eventgroups with the event gets it once.  [feat_req_someipsd_1168]
void Provider::find_receivers(const OpenOffer& offer, MethodId event, const SubscriberFilter& wanted) const {
  receivers_.clear();
  by_multicast_.clear();
  const Transport transport = transport_of(offer.spec, event);
  const auto add = [this](const Receiver& receiver) {
    const auto same = std::ranges::find_if(receivers_, [&](const Receiver& one) {
      return one.to == receiver.to && one.transport == receiver.transport;
    });
    if (same == receivers_.end()) {
      receivers_.push_back(receiver);
    } else {
      same->burst = someip::lesser_burst(same->burst, receiver.burst);
    }
  };
  const auto uses_multicast = [&](const EventgroupSpec& group) {
    if (transport == Transport::tcp || !group.multicast || group.multicast_threshold == 0 || wanted) {
      return false;
    }
    std::size_t count = 0;
    discovery_.for_each_subscriber(offer.handle, group.id, [&](const Subscriber&) { ++count; });
    return count >= group.multicast_threshold;  // [feat_req_someip_813]
  };
  for (const EventgroupSpec& group : offer.spec.eventgroups) {
    if (contains(group.events, event) && uses_multicast(group)) {
      discovery_.for_each_subscriber(offer.handle, group.id, [&](const Subscriber& subscriber) {
        add({*group.multicast, Transport::udp,
             someip::burst_into(subscriber.receive_buffer_bytes, someip::least_burst_to_group)});
        by_multicast_.push_back(subscriber.udp.value_or(subscriber.peer));
      });
    }
  }
  for (const EventgroupSpec& group : offer.spec.eventgroups) {
    if (!contains(group.events, event) || uses_multicast(group)) {
      continue;
    }
    discovery_.for_each_subscriber(offer.handle, group.id, [&](const Subscriber& subscriber) {
      const auto& to = transport == Transport::udp ? subscriber.udp : subscriber.tcp;
      const bool has_it = std::ranges::any_of(
          by_multicast_, [&](const Endpoint& other) { return other == to || other == subscriber.peer; });
      if (to && !has_it && (!wanted || wanted(subscriber))) {
        add({*to, transport, someip::burst_into(subscriber.receive_buffer_bytes)});
      }
    });
  }
}

std::size_t Provider::subscribers(OfferHandle handle, MethodId event) const {
  const auto offer = find(handle);
  if (!offer) {
    return 0;
  }
  find_receivers(*offer, event, {});
  return receivers_.size();
}

namespace {

// As the application wants, else as the receiver can take it.
someip::TpPacing with_burst(someip::TpPacing pacing, const std::optional<std::size_t>& burst) {
  pacing.burst = pacing.burst ? pacing.burst : burst;
  return pacing;
}

Header event_header(const ServiceSpec& spec, MethodId event, someip::SessionId session) {
  return {.service = spec.service,
          .method = event,
          .session = session,
          .interface_version = spec.major,
          .type = MessageType::notification};
}

}  // namespace

// [feat_req_someip_667] [feat_req_someip_700] Segments need one to be put together.  [feat_req_someiptp_762]
someip::SessionId Provider::session_of(OpenOffer& offer, MethodId event, std::size_t bytes) {
  const bool none =
      contains(offer.spec.events_without_session, event) && bytes <= someip::max_plain_payload_bytes;
  return none ? someip::SessionId{0} : offer.events[event].session.next();
}

Notified Provider::notify(OfferHandle handle, MethodId event, const SubscriberFilter& wanted,
                          std::span<const ByteView> payload, const std::shared_ptr<const void>& keep_alive,
                          const someip::TpPacing& pacing) {
  check(pacing, "pacing");
  const auto offer = find(handle);
  if (!offer) {
    return {};
  }
  if (!is_in_a_group(offer->spec, event)) {
    throw std::invalid_argument{"event " + hexadecimal(value(event)) + " of " +
                                to_string(offer->spec.service, offer->spec.instance) +
                                " is in no eventgroup"};
  }
  Ruled* const ruled = event_with_rule(*offer, event);
  if (ruled == nullptr) {
    return send_event(*offer, event, wanted, payload, keep_alive, pacing);
  }
  if (wanted) {
    throw std::invalid_argument{"an event with an update rule is for all its subscribers"};
  }
  ruled->pacing = pacing;
  return store(*offer, *ruled, std::make_shared<const std::vector<std::byte>>(joined(payload)));
}

Notified Provider::send_event(OpenOffer& offer, MethodId event, const SubscriberFilter& wanted,
                              std::span<const ByteView> payload,
                              const std::shared_ptr<const void>& keep_alive, const someip::TpPacing& pacing) {
  E2eChannel* const channel = offer.e2e.find(event);
  if (channel != nullptr && wanted) {
    throw std::invalid_argument{"an event with end-to-end protection is for all its subscribers"};
  }
  find_receivers(offer, event, wanted);
  const std::size_t bytes = size_of(payload) + (channel != nullptr ? channel->added_bytes() : 0);
  const Header header = event_header(offer.spec, event, session_of(offer, event, bytes));
  return channel != nullptr ? notify_protected(offer, *channel, header, payload, pacing)
                            : send_to_receivers(offer, header, payload, keep_alive, pacing);
}

Notified Provider::send_to_receivers(OpenOffer& offer, const Header& header,
                                     std::span<const ByteView> payload,
                                     const std::shared_ptr<const void>& keep_alive,
                                     const someip::TpPacing& pacing) {
  Notified result{.session = header.session};
  // The owner of a message that has left may send another one.
  std::vector<Receiver> receivers = std::move(receivers_);
  for (const Receiver& receiver : receivers) {
    send_to_receiver(offer, receiver, header, payload, keep_alive, pacing, result);
  }
  receivers_ = std::move(receivers);
  return result;
}

void Provider::send_to_receiver(OpenOffer& offer, const Receiver& receiver, const Header& header,
                                std::span<const ByteView> payload,
                                const std::shared_ptr<const void>& keep_alive, const someip::TpPacing& pacing,
                                Notified& result) {
  const bool by_tcp = receiver.transport == Transport::tcp;
  if (!by_tcp && !may_be_sent(offer.spec, header.method, size_of(payload))) {
    ++counters_.not_to_be_segmented;
    ++result.dropped;
    return;
  }
  if (!offer.spec.waits.empty()) {
    const someip::WaitRule& rule = offer.events[header.method].waits;
    const someip::Room room = by_tcp ? offer.tcp->server.make_room(receiver.to, header, rule)
                                     : offer.udp->sender.make_room(receiver.to, header, rule);
    if (room.dropped != 0) {
      result.overtaken += room.dropped;
      note_slow(offer, receiver, header, room.dropped);
    }
    if (!room.granted) {
      return;
    }
  }
  const bool taken = by_tcp ? offer.tcp->server.send(receiver.to, header, payload, keep_alive)
                            : offer.udp->sender.send(receiver.to, header, payload, keep_alive,
                                                     with_burst(pacing, receiver.burst));
  ++(taken ? result.subscribers : result.dropped);
  result.no_room += !taken && is_full_for(offer, receiver, size_of(payload)) ? 1U : 0U;
}

bool Provider::is_full_for(const OpenOffer& offer, const Receiver& receiver, std::size_t bytes) {
  return receiver.transport == Transport::tcp ? offer.tcp->server.is_full_for(receiver.to, bytes)
                                              : offer.udp->sender.is_full_for(receiver.to, bytes);
}

bool Provider::is_full_for(OfferHandle handle, MethodId event, std::size_t bytes) const {
  const auto offer = find(handle);
  if (!offer) {
    return false;
  }
  find_receivers(*offer, event, {});
  bytes += offer->e2e.added_bytes(event);
  return std::ranges::any_of(receivers_,
                             [&](const Receiver& one) { return is_full_for(*offer, one, bytes); });
}

void Provider::note_slow(const OpenOffer& offer, const Receiver& receiver, const Header& header,
                         std::size_t overtaken) {
  counters_.overtaken += overtaken;
  const auto found = std::ranges::find_if(slow_, [&](const Slow& one) {
    return one.subscriber.at == receiver.to && one.subscriber.transport == receiver.transport;
  });
  if (found != slow_.end()) {
    std::rotate(found, found + 1, slow_.end());
  } else {
    if (slow_.size() == max_slow) {
      slow_.erase(slow_.begin());
    }
    slow_.push_back({.subscriber = {receiver.to, receiver.transport}});
  }
  Slow& slow = slow_.back();
  slow.subscriber.overtaken += overtaken;
  slow.unsaid += overtaken;
  if (now() >= slow.next_line && now() >= next_slow_line_) {
    next_slow_line_ = now() + std::chrono::seconds{1};
    slow.next_line = now() + slow_pause;
    warn_(someip::to_string(receiver.to) + (receiver.transport == Transport::tcp ? " (TCP)" : " (UDP)") +
          " takes events more slowly than they come, or is gone; the last was " +
          hexadecimal(value(header.method)) + " of " + to_string(offer.spec.service, offer.spec.instance) +
          ": " + std::to_string(std::exchange(slow.unsaid, 0)) + " dropped for it, none for others");
  }
}

std::vector<SlowSubscriber> Provider::slow_subscribers() const {
  std::vector<SlowSubscriber> all(slow_.size());
  std::ranges::transform(slow_, all.begin(), &Slow::subscriber);
  return all;
}

// --- Requests ---------------------------------------------------------------------------------------------

MethodKind Provider::kind_of(const OpenOffer& offer, MethodId id) const {
  const auto method = std::ranges::find(offer.spec.methods, id, &MethodSpec::id);
  if (method != offer.spec.methods.end()) {
    return method->kind;
  }
  const bool accessor = std::ranges::any_of(
      offer.spec.fields, [id](const FieldSpec& field) { return field.getter == id || field.setter == id; });
  return accessor ? MethodKind::request_response : MethodKind::unknown;
}

someip::TpPacing Provider::pacing_of(const ServiceSpec& spec, MethodId id) const {
  const auto method = std::ranges::find(spec.methods, id, &MethodSpec::id);
  if (method != spec.methods.end()) {
    return method->pacing.value_or(config_.pacing);
  }
  const auto field = std::ranges::find_if(
      spec.fields, [id](const FieldSpec& one) { return one.getter == id || one.setter == id; });
  return field == spec.fields.end() ? config_.pacing : field->pacing.value_or(config_.pacing);
}

Provider::Judged Provider::judge(const Header& header, const Source& source) {
  someip::RequestTarget target;
  Judged judged{.offer = nullptr, .rules = &config_.answers, .check = {}};
  // Those of the interface of the request, if any.  [feat_req_someip_726] [feat_req_someip_106]
  for (const auto& one : offers_) {
    const bool here = source.udp ? one->udp == source.udp : one->tcp == source.tcp;
    if (!here || one->spec.service != header.service) {
      continue;
    }
    target.service = true;
    if (!judged.offer && one->spec.answers) {
      judged.rules = &*one->spec.answers;
    }
    if (one->spec.major == header.interface_version) {
      target.interface_version = true;
      target.method = kind_of(*one, header.method);
      judged.offer = one;
      judged.rules = one->spec.answers ? &*one->spec.answers : &config_.answers;
    }
  }
  // Before anything is told of the service.
  if (judged.offer && access_.has_policies() &&
      !access_.allows({.access = Access::call,
                       .service = header.service,
                       .instance = judged.offer->spec.instance,
                       .member = someip::value(header.method)},
                      source.from.address)) {
    access_.say_what_was_refused();
    judged.is_allowed = false;
    judged.check.fault = ReturnCode::not_ok;
    if (config_.access.answer_calls) {
      judged.check.answer = someip::error_answer(header, ReturnCode::not_ok, *judged.rules);
    }
    return judged;
  }
  judged.check = someip::check_request(header, target, *judged.rules);
  return judged;
}

void Provider::refuse(const Judged& judged, const Source& source) {
  if (judged.check.answer) {
    ++counters_.requests_answered;
    reply_path(source, true).send(*judged.check.answer, {}, nullptr);
  } else if (judged.is_allowed) {
    ++counters_.unexpected;
  }
}

std::size_t Provider::room_for(const Message& segment, const Source& source) {
  if (!source.udp) {
    ++counters_.unexpected;  // by multicast
    return 0;
  }
  Header header = segment.header;
  header.type = someip::without_tp(header.type);
  Judged judged = judge(header, source);
  if (!judged.check.fault) {
    const ServiceSpec& spec = judged.offer->spec;
    const bool is_getter = std::ranges::any_of(
        spec.fields, [&](const FieldSpec& field) { return field.getter == header.method; });
    const auto method = std::ranges::find(spec.methods, header.method, &MethodSpec::id);
    const std::size_t most = method == spec.methods.end()
                                 ? config_.max_message_bytes
                                 : method->max_request_bytes.value_or(config_.max_message_bytes);
    if (!is_getter && most > someip::max_plain_payload_bytes &&
        may_be_sent(spec, header.method, someip::max_plain_payload_bytes + 1)) {
      return most;
    }
    // [feat_req_someiptp_788] A getter is called with nothing.  [feat_req_someip_633]
    judged.check = {ReturnCode::not_ok, someip::error_answer(header, ReturnCode::not_ok, *judged.rules)};
  }
  // One answer to all segments: to the one that is there whatever the size.
  const auto tp = someip::decode_tp(segment);
  if (!tp || tp->header.offset != 0) {
    judged.check.answer.reset();
  }
  refuse(judged, source);
  return 0;
}

void Provider::on_request(const Message& message, const Source& source) {
  if (!source.udp && !source.tcp) {
    ++counters_.unexpected;  // by multicast, or over a connection that is ours to call through
    return;
  }
  if (!access_.takes_request(source.from.address, source.transport)) {
    return;
  }
  const Judged judged = judge(message.header, source);
  if (judged.check.fault) {
    refuse(judged, source);
    return;
  }
  const bool answered = message.header.type == MessageType::request;
  ReplyPath path = reply_path(
      source, may_be_sent(judged.offer->spec, message.header.method, someip::max_plain_payload_bytes + 1));
  path.pacing = pacing_of(judged.offer->spec, message.header.method);
  if (E2eChannel* const channel = judged.offer->e2e.find(message.header.method)) {
    handle_checked(judged.offer, *channel, message, source, std::move(path));
    return;
  }
  ++counters_.requests;
  handle(judged.offer, message, {message.header, *judged.rules, std::move(path), answered});
}

ReplyPath Provider::reply_path(const Source& source, bool in_segments) {
  return {.to = source.from,
          .udp = source.udp,
          .tcp = source.tcp,
          .in_segments = in_segments,
          .pacing = config_.pacing,
          .counters = &counters_,
          .discovery = &discovery_,
          .may_be_sent = &may_be_sent_,
          .not_there = &not_there_};
}

void Provider::say_who_is_silent(const IpAddress& to) {
  if (const std::uint64_t answers = answers_to_silent_.to_tell(1)) {
    warn_("dropped " + std::to_string(answers) + " answers over UDP, the last one to " +
          someip::to_string(to) +
          ": too many hosts have asked that are not there, or somebody has asked in their names");
  }
}

bool Provider::may_receive(const Endpoint& to, std::size_t bytes) {
  if (is_of_this_host(to.address, config_.address) || discovery_.is_proven(to.address)) {
    return true;
  }
  discovery_.doubt(to.address);
  if (unproven_.take(to.address, bytes, now())) {
    return true;
  }
  if (refused_answers_.to_tell(1) != 0) {
    warn_("refused an answer of " + std::to_string(bytes) + " bytes over UDP to " +
          someip::to_string(to.address) +
          ": it has no TCP connection here, and no subscription that it has proven to be its own, so "
          "somebody else may have asked in its name "
          "(unproven_answer_bytes, unproven_answer_rate)");
  }
  return false;
}

// Holds the offer: a handler may withdraw it.
void Provider::handle(const std::shared_ptr<OpenOffer>& offer, const Message& message, Responder responder) {
  const auto method = std::ranges::find(offer->spec.methods, message.header.method, &MethodSpec::id);
  if (method != offer->spec.methods.end()) {
    method->handler(message, std::move(responder));
    return;
  }
  const std::size_t field = *field_of(*offer, message.header.method);
  if (offer->spec.fields[field].setter == message.header.method) {
    call_setter(*offer, field, message.payload, responder);
    // A getter has no parameters [feat_req_someip_633]; a payload comes from a newer client.
    // [feat_req_someip_168]
  } else if (const auto value = offer->values[field].value) {
    const ByteView bytes{*value};
    responder.respond({&bytes, 1}, value);
  } else {
    responder.error(offer->spec.fields[field].without_value);
  }
}

// --- Initial events ---------------------------------------------------------------------------------------

// By unicast, and also when the subscriber has them by another eventgroup.  [feat_req_someipsd_793]
// [feat_req_someipsd_1167] Events that are no field's have no initial value.  [feat_req_someipsd_833]
void Provider::send_initial_values(OfferHandle handle, EventgroupId eventgroup,
                                   const Subscriber& subscriber) {
  const auto offer = find(handle);
  if (!offer) {
    return;
  }
  const auto group = std::ranges::find(offer->spec.eventgroups, eventgroup, &EventgroupSpec::id);
  if (group == offer->spec.eventgroups.end()) {
    return;
  }
  for (const MethodId event : group->events) {
    const auto field = field_of(*offer, event);
    auto value = field ? offer->values[*field].value : nullptr;
    if (!value) {
      continue;
    }
    const std::size_t size = value->size() + offer->e2e.added_bytes(event);
    const Transport transport = transport_of(offer->spec, event);
    const std::optional<Endpoint>& to = transport == Transport::tcp ? subscriber.tcp : subscriber.udp;
    if (!to || (transport == Transport::udp && !may_be_repeated(*offer, event, *to, size))) {
      continue;
    }
    const Header header = event_header(offer->spec, event, session_of(*offer, event, size));
    if (E2eChannel* const channel = offer->e2e.find(event)) {
      value = channel->protect_again(header, *value);
      if (!value) {
        ++counters_.e2e_not_protected;
        continue;
      }
    }
    const ByteView bytes{*value};
    Notified result;
    send_to_receiver(*offer, {*to, transport, someip::burst_into(subscriber.receive_buffer_bytes)}, header,
                     {&bytes, 1}, value, offer->values[*field].pacing, result);
  }
}

bool Provider::may_be_repeated(const OpenOffer& offer, MethodId event, const Endpoint& to,
                               std::size_t bytes) {
  if (is_of_this_host(to.address, config_.address) ||
      repeated_.take(to.address, offer.handle, event, bytes, now())) {
    return true;
  }
  ++counters_.repeated_values_refused;
  if (repeated_values_.to_tell(1) != 0) {
    warn_("the initial value of event " + hexadecimal(value(event)) + " of " +
          to_string(offer.spec.service, offer.spec.instance) + ", " + std::to_string(bytes) +
          " bytes, was not sent to " + someip::to_string(to.address) +
          ": it has just been sent there several times, and somebody else may subscribe in its name "
          "(max_repeated_values)");
  }
  return false;
}

// --- What discovery tells ---------------------------------------------------------------------------------

void Provider::on_event(const SubscriberAdded& event) {
  log_subscriber(event, "subscribed to");
  if (const auto offer = find(event.offer); offer && offer->udp && event.subscriber.udp) {
    offer->udp->sender.meet(*event.subscriber.udp);
    // It may soon ask for what is only sent to hosts that have shown to receive it.
    if (std::ranges::any_of(offer->values, [&](const auto& one) {
          return one.value && one.value->size() > someip::max_plain_payload_bytes;
        })) {
      discovery_.doubt(event.subscriber.udp->address);
    }
  }
  if (event.initial_data) {
    send_initial_values(event.offer, event.eventgroup, event.subscriber);
  }
}

void Provider::on_event(const InitialDataRequested& event) {
  send_initial_values(event.offer, event.eventgroup, event.subscriber);
}

void Provider::on_event(const SubscriberRemoved& event) {
  log_subscriber(event, std::string{to_string(event.reason)} + ", no longer subscribed to");
  const auto offer = find(event.offer);
  if (event.reason == LossReason::link_down && event.subscriber.tcp && offer && offer->tcp) {
    offer->tcp->server.disconnect(*event.subscriber.tcp, "the link is down");  // [feat_req_someipsd_437]
  }
  const std::optional<Endpoint>& udp = event.subscriber.udp;
  if (offer && offer->udp && udp && !discovery_.is_proven(udp->address)) {
    offer->udp->sender.part(*udp);
  }
}

template <typename SubscriberEvent>
void Provider::log_subscriber(const SubscriberEvent& event, const std::string& what) const {
  if (const auto offer = find(event.offer)) {
    const Subscriber& subscriber = event.subscriber;
    const Endpoint& at = subscriber.udp   ? *subscriber.udp
                         : subscriber.tcp ? *subscriber.tcp
                                          : subscriber.peer;
    log_(someip::to_string(at) + " " + what + " eventgroup " + hexadecimal(value(event.eventgroup)) + " of " +
         to_string(offer->spec.service, offer->spec.instance));
  }
}

}  // namespace trestle::sd
