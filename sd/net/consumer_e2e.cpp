// Consumer: end-to-end protection of events, requests and responses.
#include <algorithm>
#include <stdexcept>

#include "sd/net/consumer.hpp"
#include "sd/net/discovery_text.hpp"

namespace trestle::sd {

namespace e2e = someip::e2e;
using someip::Header;
using someip::Message;

namespace {

std::string in_words(const E2eSpec& spec) {
  return "e2e of " + hexadecimal(value(spec.id)) + ": ";
}

}  // namespace

// Requirements of one service share what they have in common: to the server they are one client, whose
// requests have one counter.
E2eChannels Consumer::channels_of(const RequireSpec& spec) const {
  E2eChannels channels;
  for (const E2eSpec& one : spec.e2e) {
    const auto refuse = [&](const std::string& why) {
      throw std::invalid_argument{"requirement of " + to_string(spec.service, spec.instance) + ": " +
                                  in_words(one) + why};
    };
    if (is_reserved(one.id)) {
      refuse("the id is reserved");
    }
    if (channels.find(one.id) != nullptr) {
      refuse("there is more than one");
    }
    std::shared_ptr<E2eChannel> channel;
    for (const auto& other : requirements_) {
      E2eChannel* const there = other->spec.service == spec.service ? other->e2e.find(one.id) : nullptr;
      if (there != nullptr && there->spec() != one) {
        refuse("another requirement of the service has another");
      }
      channel = there != nullptr ? there->shared_from_this() : channel;
    }
    try {
      channels.add(channel ? channel : std::make_shared<E2eChannel>(one));
    } catch (const std::invalid_argument& mistake) {
      throw std::invalid_argument{"requirement of " + to_string(spec.service, spec.instance) + ": " +
                                  mistake.what()};
    }
  }
  return channels;
}

E2eChannels Consumer::channels_of(const SubscribeSpec& spec) {
  const std::string name = "subscription to eventgroup " + hexadecimal(value(spec.eventgroup)) + " of " +
                           to_string(spec.service, spec.instance) + ": ";
  E2eChannels channels;
  for (const E2eSpec& one : spec.e2e) {
    const auto refuse = [&](const std::string& why) {
      std::string mistake = name;
      mistake += in_words(one);
      mistake += why;
      throw std::invalid_argument{mistake};
    };
    if (std::ranges::find(spec.events, one.id) == spec.events.end()) {
      refuse("it is not among the events");
    }
    if (one.protect || !one.check) {
      refuse("an event is received: it has check, not protect");
    }
    if (channels.find(one.id) != nullptr) {
      refuse("there is more than one");
    }
    try {
      channels.add(std::make_shared<E2eChannel>(one));
    } catch (const std::invalid_argument& mistake) {
      throw std::invalid_argument{name + mistake.what()};
    }
  }
  return channels;
}

void Consumer::deliver_checked(const Listener& listener, E2eChannel& channel, Message message,
                               const Source& source) {
  std::vector<std::byte> room;
  const e2e::CheckResult result = channel.check({source.from, source.transport}, message, {}, true, room);
  if (!channel.passes(result)) {
    ++counters_.e2e_failed;
    return;
  }
  message.check = &result;
  listener.handler(message, source.from);
}

std::optional<CallFault> Consumer::transmit_protected(E2eChannel& channel, const CallPath& route,
                                                      const RequireSpec& spec, const Header& header,
                                                      std::span<const ByteView> payload) {
  const E2ePeer to{route.target.server, route.target.transport};
  const E2eChannel::Bytes bytes =
      channel.protect(to, header, payload, {.source_id = channel.spec().source_id});
  if (!bytes) {
    ++counters_.e2e_not_protected;
    return CallFault::not_sent;
  }
  const ByteView slice{*bytes};
  const auto fault = transmit_bytes(route, spec, header, {&slice, 1}, bytes);
  if (fault) {  // the caller knows; the server need not miss it
    channel.take_back(to);
  }
  return fault;
}

// Looks at the answer before `handler` does.
ResponseHandler Consumer::checked(E2eChannel& channel, const someip::CallTarget& target,
                                  ResponseHandler handler) {
  return [this, channel = channel.shared_from_this(), from = E2ePeer{target.server, target.transport},
          handler = std::move(handler)](const CallResult& result) {
    Message message;
    if (result) {
      message = *result;
    } else if (result.error().header != nullptr && !result.error().payload.empty()) {
      message = {*result.error().header, result.error().payload};
    } else {
      handler(result);  // no answer, or an error without protection: of the server's stack, say
      return;
    }
    std::vector<std::byte> room;
    const e2e::CheckResult check = channel->check(
        from, message, {.response = true, .error = !result, .source_id = channel->spec().source_id}, true,
        room);
    if (!channel->passes(check)) {
      ++counters_.e2e_failed;
      handler(tl::unexpected{CallError{.fault = CallFault::error,
                                       .code = code_of(check.status),
                                       .header = &message.header,
                                       .check = &check}});
    } else if (result) {
      message.check = &check;
      handler(message);
    } else {
      handler(tl::unexpected{CallError{.fault = CallFault::error,
                                       .code = result.error().code,
                                       .payload = message.payload,
                                       .header = &message.header,
                                       .check = &check}});
    }
  };
}

}  // namespace trestle::sd
