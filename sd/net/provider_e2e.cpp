// Provider: end-to-end protection of events, requests and responses.
#include <algorithm>
#include <stdexcept>

#include "sd/net/discovery_text.hpp"
#include "sd/net/provider.hpp"

namespace trestle::sd {

namespace e2e = someip::e2e;
using someip::Header;
using someip::Message;
using someip::ReturnCode;

// What the description of a service says of protection.
E2eChannels Provider::channels_of(const ServiceSpec& spec) {
  E2eChannels channels;
  for (const E2eSpec& one : spec.e2e) {
    const auto refuse = [&](const std::string& why) {
      throw std::invalid_argument{"e2e of " + hexadecimal(value(one.id)) + ": " + why};
    };
    const auto method = std::ranges::find(spec.methods, one.id, &MethodSpec::id);
    const auto accessor = std::ranges::find_if(spec.fields, [&](const FieldSpec& field) {
      return field.getter == one.id || field.setter == one.id;
    });
    const bool event =
        std::ranges::any_of(spec.eventgroups,
                            [&](const EventgroupSpec& group) {
                              return std::ranges::find(group.events, one.id) != group.events.end();
                            }) ||
        std::ranges::find(spec.fields, one.id, &FieldSpec::notifier) != spec.fields.end();
    if (event && (one.check || !one.protect)) {
      refuse("an event is sent: it has protect, not check");
    }
    if (!event && method == spec.methods.end() && accessor == spec.fields.end()) {
      refuse("there is no such method or event");
    }
    if (method != spec.methods.end() && method->kind == someip::MethodKind::fire_and_forget && one.protect) {
      refuse("the method has no response to protect");
    }
    if (accessor != spec.fields.end() && one.pass_failed) {
      refuse("pass_failed must be: false for a getter or setter");
    }
    if (channels.find(one.id) != nullptr) {
      refuse("there is more than one");
    }
    channels.add(std::make_shared<E2eChannel>(one));
  }
  return channels;
}

// To those of receivers_. One message with one counter for all of them: the protection is the event's.
Notified Provider::notify_protected(OpenOffer& offer, E2eChannel& channel, const Header& header,
                                    std::span<const ByteView> payload, const someip::TpPacing& pacing) {
  if (receivers_.empty()) {
    return {.session = header.session};
  }
  const E2eChannel::Bytes bytes = channel.protect({}, header, payload);
  if (!bytes) {
    ++counters_.e2e_not_protected;
    return {.session = header.session, .dropped = receivers_.size()};
  }
  const ByteView slice{*bytes};
  return send_to_receivers(offer, header, {&slice, 1}, bytes, pacing);
}

void Provider::handle_checked(const std::shared_ptr<OpenOffer>& offer, E2eChannel& channel, Message message,
                              const Source& source, ReplyPath path) {
  e2e::CheckResult result;
  std::vector<std::byte> room;
  if (channel.checks()) {
    result = channel.check({source.from, source.transport, message.header.client}, message, {}, false, room);
    message.check = &result;
  }
  const bool passes = !channel.checks() || channel.passes(result);
  // What could not be understood has no counter and no source that an answer could repeat.
  if (channel.protects() && (passes || result.fault == e2e::Fault::none)) {
    path.protection = std::make_shared<const E2eReply>(E2eReply{channel.shared_from_this(), result});
  }
  const bool answered = message.header.type == someip::MessageType::request;
  const someip::AnswerRules& rules = offer->spec.answers ? *offer->spec.answers : config_.answers;
  Responder responder{message.header, rules, std::move(path), answered};
  if (!passes) {
    ++counters_.e2e_failed;
    responder.error(code_of(result.status));
    return;
  }
  ++counters_.requests;
  handle(offer, message, std::move(responder));
}

// An answer repeats the counter and the source of its request: so each client sees a sequence of its own.
bool ReplyPath::send_protected(const Header& header, std::span<const ByteView> payload) const {
  if (udp.expired() && tcp.expired()) {  // and with them maybe our node
    return false;
  }
  const auto& channel = protection->channel;
  const e2e::CheckResult& request = protection->request;
  const bool counted = channel->checks() && request.fault == e2e::Fault::none;
  if (header.return_code == ReturnCode::e2e && request.fault != e2e::Fault::none) {
    // The handler, who gets everything, says so itself: with the same bytes as above.
    return send_bytes(header, {}, nullptr);
  }
  const auto protect = [&](const Header& as, std::span<const ByteView> what) {
    const e2e::MethodInfo method{
        .response = true,
        .error = as.return_code != ReturnCode::ok,
        .source_id = channel->checks() ? request.source_id : channel->spec().source_id};
    return counted ? channel->protect_as(request.counter, as, what, method)
                   : channel->protect({}, as, what, method);
  };
  E2eChannel::Bytes bytes = protect(header, payload);
  if (bytes) {
    const ByteView slice{*bytes};
    return send_bytes(header, {&slice, 1}, bytes);
  }
  // The profile has no such length. An error is then sent unprotected, so that the caller need not wait in
  // vain; an answer becomes such an error.
  Header failed = header;
  if (header.return_code == ReturnCode::ok) {
    ++counters->e2e_not_protected;
    failed.return_code = ReturnCode::not_ok;
    bytes = protect(failed, {});
  }
  const ByteView slice = bytes ? ByteView{*bytes} : ByteView{};
  const bool sent = send_bytes(failed, {&slice, 1}, bytes);
  return sent && header.return_code != ReturnCode::ok;
}

}  // namespace trestle::sd
