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

/// The channels that `whose` describes.
/// @param mistake  what is wrong with one, or null.
/// @param shared   the channel of another one that it has in common with it, or null.
template <typename Mistake, typename Shared>
E2eChannels channels_for(const std::string& whose, const std::vector<E2eSpec>& specs, const Mistake& mistake,
                         const Shared& shared) {
  E2eChannels channels;
  for (const E2eSpec& one : specs) {
    const char* const why = channels.find(one.id) != nullptr ? "there is more than one" : mistake(one);
    if (why != nullptr) {
      throw std::invalid_argument{whose + ": e2e of " + hexadecimal(value(one.id)) + ": " + why};
    }
    try {
      E2eChannel* const there = shared(one);
      channels.add(there != nullptr ? there->shared_from_this() : std::make_shared<E2eChannel>(one));
    } catch (const std::invalid_argument& wrong) {
      throw std::invalid_argument{whose + ": " + wrong.what()};
    }
  }
  return channels;
}

}  // namespace

// Requirements of one service share their channels: to the server they are one client, with one counter. Only
// for certain instances, which are different servers, may they be different.
E2eChannels Consumer::channels_of(const RequireSpec& spec) const {
  // The last one for which `is_wanted`.
  const auto last = [&](const E2eSpec& one, const auto& is_wanted) {
    E2eChannel* there = nullptr;
    for (const auto& other : requirements_) {
      E2eChannel* const its = other->spec.service == spec.service ? other->e2e.find(one.id) : nullptr;
      there = its != nullptr && is_wanted(other->spec, *its) ? its : there;
    }
    return there;
  };
  const auto shared = [&](const E2eSpec& one) {
    return last(one, [&](const RequireSpec&, const E2eChannel& its) { return its.spec() == one; });
  };
  const auto mistake = [&](const E2eSpec& one) {
    const bool contradicts = last(one, [&](const RequireSpec& other, const E2eChannel& its) {
                               const bool are_apart = other.instance != spec.instance &&
                                                      other.instance != someip::any_instance &&
                                                      spec.instance != someip::any_instance;
                               return !are_apart && its.spec() != one;
                             }) != nullptr;
    return is_reserved(one.id) ? "the id is reserved"
           : contradicts       ? "another requirement of the service has another"
                               : nullptr;
  };
  return channels_for("requirement of " + to_string(spec.service, spec.instance), spec.e2e, mistake, shared);
}

E2eChannels Consumer::channels_of(const SubscribeSpec& spec) {
  const auto mistake = [&](const E2eSpec& one) {
    return std::ranges::find(spec.events, one.id) == spec.events.end() ? "it is not among the events"
           : one.protect || !one.check ? "an event is received: it has check, not protect"
                                       : nullptr;
  };
  return channels_for("subscription to eventgroup " + hexadecimal(value(spec.eventgroup)) + " of " +
                          to_string(spec.service, spec.instance),
                      spec.e2e, mistake, [](const E2eSpec&) -> E2eChannel* { return nullptr; });
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
