// Nodes that tell each other, in messages to one another, what their sockets have room for. See
// receive_buffer.hpp.
//
// Whoever requires a service tells its server in a message without entries, once an Offer is there; a Find
// would be wrong then [feat_req_someipsd_238]. The server tells the same, and asks for a number to be given
// back. A client that speaks in another's name gets no further: large answers would otherwise be sent to that
// one without its asking. Who requires nothing of the server does not answer.
#include "sd/core/receive_buffer.hpp"
#include "sd/core/service_discovery.hpp"
#include "sd/wire/writer.hpp"

namespace trestle::sd {
namespace {

using std::chrono::seconds;

constexpr Duration tell_pause = seconds{60};
constexpr Duration untold_pause = seconds{1};
constexpr Duration proven_for = seconds{200};  // three of them, and some
constexpr std::uint8_t most_untold = 3;        // to a server that does not tell us

// About a minute. A question is one for so long, and its answer is taken for as long again.
std::uint64_t period_of(TimePoint now) noexcept {
  return static_cast<std::uint64_t>(now.time_since_epoch().count()) >> 36U;
}

}  // namespace

// Only who receives it knows it, without a generator for secrets: who gets such numbers at many addresses
// might find out those of others by trying all seeds.
std::uint32_t ServiceDiscovery::question_to(const Endpoint& peer, std::uint64_t period) const noexcept {
  std::uint64_t mixed = Random{settings_.seed ^ period}.next();
  std::array<std::uint64_t, 2> words{};
  for (std::size_t i = 0; i < peer.address.bytes.size(); ++i) {
    words[i / 8] = (words[i / 8] << 8U) | static_cast<std::uint64_t>(peer.address.bytes[i]);
  }
  for (const std::uint64_t word : {words[0], words[1], std::uint64_t{peer.port}, settings_.seed}) {
    mixed = Random{mixed ^ word}.next();
  }
  return std::max<std::uint32_t>(static_cast<std::uint32_t>(mixed >> 32U), 1);
}

void ServiceDiscovery::hear(std::uint16_t index, const SdMessage& message, TimePoint now) noexcept {
  slots::Peer& peer = peers_[index];
  if (message.entry_count() != 0 || !tells_receive_buffer() || !peer.explicit_initial_data) {
    return;
  }
  const NodeTold told = told_in(message);
  if (told.receive_buffer_bytes == 0 || !may_go_on(index, 1, now)) {
    return;
  }
  for (slots::Acquaintance& it : peer.acquaintance) {  // the one
    const std::uint64_t period = period_of(now);
    const bool is_current = told.answer == question_to(peer.endpoint, period);
    const bool is_answered = is_current || told.answer == question_to(peer.endpoint, period - 1);
    if (is_answered) {
      it.proven_until = now + proven_for;
    }
    // Of who is proven, nobody else may say anything.
    if (is_answered || is_due(it.proven_until, now)) {
      it.receive_buffer_bytes = told.receive_buffer_bytes;
    }
    const bool is_server = it.tell_due != TimePoint{};
    if (told.question != 0 && is_server) {
      it.answer = told.question;
      tell(index, now, false);
    } else if (told.question == 0 && !is_current) {
      tell(index, now, true);
    }
  }
}

void ServiceDiscovery::tell(std::uint16_t peer, TimePoint due, bool asks) noexcept {
  slots::PendingEntry* const pending = has_room_for_answer(peer) ? send(peer, due) : nullptr;
  if (pending != nullptr) {
    pending->told = asks ? slots::PendingEntry::Told::with_question : slots::PendingEntry::Told::yes;
  }
}

NodeTold ServiceDiscovery::what_to_tell(const slots::PendingEntry& pending, TimePoint now) const noexcept {
  const slots::Peer& peer = peers_[pending.peer];
  NodeTold told;
  if (pending.told == slots::PendingEntry::Told::with_question) {
    told.question = question_to(peer.endpoint, period_of(now));
  }
  for (const std::uint32_t bytes : receive_buffer_) {  // the one
    told.receive_buffer_bytes = bytes;
  }
  for (const slots::Acquaintance& it : peer.acquaintance) {  // the one
    told.answer = it.answer;
  }
  return told;
}

// Tells the server of a service that is required, after an Offer. No other one is told.
void ServiceDiscovery::get_acquainted(const slots::Remote& server, const Arrival& arrival) noexcept {
  if (!tells_receive_buffer() || !server.is_wanted || !server.udp || server.service == other_protocols ||
      !peers_[server.peer].explicit_initial_data) {
    return;
  }
  for (slots::Acquaintance& it : peers_[server.peer].acquaintance) {  // the one
    if (!is_due(it.tell_due, arrival.now)) {
      continue;
    }
    const bool has_told = it.receive_buffer_bytes != 0;
    it.untold = static_cast<std::uint8_t>(has_told ? 0 : it.untold + 1);
    it.tell_due = has_told                  ? arrival.now + tell_pause
                  : it.untold < most_untold ? arrival.now + untold_pause
                                            : never;
    // At once where it is new: the first call may come as soon.
    tell(server.peer, has_told ? arrival.answer_due : arrival.now, false);
  }
}

std::uint32_t ServiceDiscovery::known_buffer_of(const std::optional<Endpoint>& at) const noexcept {
  if (!at || settings_.receive_buffers == nullptr) {
    return 0;
  }
  const auto known = std::ranges::find(*settings_.receive_buffers, at->address, &ReceiveBuffer::host);
  return known == settings_.receive_buffers->end() ? 0 : known->bytes;
}

std::uint32_t ServiceDiscovery::receive_buffer_of(RemoteHandle server) const noexcept {
  const slots::Remote* const remote = remotes_.find(server);
  if (remote == nullptr) {
    return 0;
  }
  std::uint32_t bytes = known_buffer_of(remote->udp);
  bytes = bytes != 0 ? bytes : receive_buffer_in(configuration(server));
  for (const slots::Acquaintance& it : peers_[remote->peer].acquaintance) {  // the one
    bytes = bytes != 0 ? bytes : it.receive_buffer_bytes;
  }
  return bytes;
}

std::uint32_t ServiceDiscovery::receive_buffer_of(const Endpoint& client, TimePoint now) const noexcept {
  if (const std::uint32_t bytes = known_buffer_of(client)) {
    return bytes;
  }
  for (const slots::Subscriber& slot : subscribers_) {
    if (slot.udp == client && slot.receive_buffer_bytes != 0) {
      return slot.receive_buffer_bytes;
    }
  }
  std::uint32_t least = 0;
  for (const slots::Peer& peer : peers_) {
    for (const slots::Acquaintance& it : peer.acquaintance) {  // the one
      if (peer.endpoint.address != client.address) {
        continue;
      }
      if (it.receive_buffer_bytes == 0 || is_due(it.proven_until, now)) {
        return 0;  // it may be that of this node
      }
      least = least == 0 ? it.receive_buffer_bytes : std::min(least, it.receive_buffer_bytes);
    }
  }
  return least;
}

bool ServiceDiscovery::has_answered_us(const IpAddress& address, TimePoint now) const noexcept {
  return peers_.find_if([&](const slots::Peer& peer) {
    return peer.endpoint.address == address &&
           std::ranges::any_of(peer.acquaintance,
                               [&](const slots::Acquaintance& it) { return !is_due(it.proven_until, now); });
  }) != nullptr;
}

}  // namespace trestle::sd
