#include "someip/net/send_lanes.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace trestle::someip {
namespace {

constexpr std::size_t max_unused = 64;      // places that are kept for reuse
constexpr std::size_t max_idle_lanes = 64;  // receivers whose last burst is remembered
// What a message takes beside its payload: counted, as small messages must not take unlimited memory, too.
constexpr std::size_t place_bytes = sizeof(PendingMessage);

// Whether both have one Message ID.
bool are_alike(const Header& a, const Header& b) noexcept {
  return a.service == b.service && a.method == b.method;
}

}  // namespace

void take(const std::vector<ByteView>& slices, SliceCursor& cursor, std::size_t bytes,
          std::vector<ByteView>& to) {
  while (bytes > 0) {
    const ByteView slice = slices[cursor.slice].subspan(cursor.offset);
    const ByteView piece = slice.first(std::min(bytes, slice.size()));
    if (!piece.empty()) {
      to.push_back(piece);
    }
    bytes -= piece.size();
    cursor.offset += piece.size();
    if (piece.size() == slice.size()) {
      cursor = {cursor.slice + 1, 0};
    }
  }
}

bool SendLanes::empty() const noexcept {
  return std::ranges::all_of(lanes_, [](const SendLane& lane) { return lane.queue.empty(); });
}

bool SendLanes::must_wait(const Endpoint& to, const Header& header) const {
  const auto lane = std::ranges::find(lanes_, to, &SendLane::to);
  return lane != lanes_.end() &&
         (lane->host || std::ranges::any_of(lane->queue, [&](const PendingMessage& pending) {
            return pending.datagram || are_alike(pending.header, header);
          }));
}

// When there are many lanes, a new receiver takes over the one that has been idle the longest.
SendLane& SendLanes::lane_of(const Endpoint& to) {
  SendLane* idle = nullptr;
  for (SendLane& lane : lanes_) {
    if (lane.to == to) {
      return lane;
    }
    if (lane.queue.empty() && !lane.host && (idle == nullptr || lane.pace.begin() < idle->pace.begin())) {
      idle = &lane;
    }
  }
  if (idle == nullptr || lanes_.size() < max_idle_lanes) {
    idle = &lanes_.emplace_back(SendLane{.to = to, .share = &share_of(to.address)});
  } else {
    --idle->share->lanes;
    idle->share = &share_of(to.address);
    idle->to = to;
    idle->pace = {};
  }
  ++idle->share->lanes;
  return *idle;
}

AddressShare& SendLanes::share_of(const IpAddress& address) {
  AddressShare* unused = nullptr;
  for (AddressShare& share : shares_) {
    if (share.lanes == 0) {
      unused = &share;
    } else if (share.address == address) {
      return share;
    }
  }
  if (unused == nullptr) {
    return shares_.emplace_back(AddressShare{.address = address});
  }
  *unused = {.address = address};
  return *unused;
}

void SendLanes::count(SendLane& lane, std::size_t bytes) noexcept {
  lane.bytes += bytes;
  lane.share->bytes += bytes;
  bytes_ += bytes;
}

void SendLanes::discount(SendLane& lane, std::size_t bytes) noexcept {
  lane.bytes -= bytes;
  lane.share->bytes -= bytes;
  bytes_ -= bytes;
}

void SendLanes::begin_round() noexcept {
  for (AddressShare& share : shares_) {
    share.served = false;
  }
}

std::size_t SendLanes::waiting() const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(lanes_, [](const SendLane& lane) { return !lane.queue.empty(); }));
}

PendingMessage* SendLanes::add(const Endpoint& to, std::span<const ByteView> parts, std::size_t bytes,
                               bool keep) {
  if (!make_way(to, bytes)) {
    return nullptr;
  }
  if (unused_.empty()) {
    unused_.emplace_front();
  }
  PendingMessage& place = unused_.front();  // the one used last, which is still in the cache
  place.bytes = bytes;
  place.slices.assign(parts.begin(), parts.end());
  place.cursor = {};
  place.begun = false;
  place.lent = false;
  if (!keep) {
    // For the whole message, even if less is left to copy: so the next one of this size can reuse the memory.
    place.copy = copies_.take(bytes);
  }
  SendLane& lane = lane_of(to);
  lane.queue.splice(lane.queue.end(), unused_, unused_.begin());
  count(lane, bytes + place_bytes);
  return &place;
}

bool SendLanes::make_way(const Endpoint& to, std::size_t bytes) {
  while (!fits(bytes)) {
    const Yielding oldest = who_gives_way(to, bytes);
    if (oldest.lane == nullptr) {
      return false;
    }
    gave_way_ += oldest.message->messages;
    drop(*oldest.lane, oldest.message);
  }
  return true;
}

bool SendLanes::is_full_for(const Endpoint& to, std::size_t bytes) {
  return bytes <= max_bytes_ && !fits(bytes) && who_gives_way(to, bytes).lane == nullptr;
}

SendLanes::Yielding SendLanes::who_gives_way(const Endpoint& to, std::size_t bytes) {
  std::size_t own = bytes + place_bytes;  // with the new one
  std::size_t of_address = own;
  for (const SendLane& lane : lanes_) {
    own += lane.to == to ? lane.bytes : 0;
    of_address += lane.to.address == to.address ? lane.bytes : 0;
  }
  const bool silent = awaiting(to) != nullptr;
  const auto gives_way_first = [&](const SendLane& lane) { return lane.host && !silent; };
  const auto order = [&](const SendLane& lane) {
    return std::tuple{gives_way_first(lane), lane.share->bytes, lane.bytes};
  };
  Yielding most;
  for (SendLane& lane : lanes_) {
    const bool has_more = lane.to.address == to.address ? lane.bytes > own : lane.share->bytes > of_address;
    const bool may_give = gives_way_first(lane) || (has_more && (!silent || lane.host));
    if (!may_give || (most.lane != nullptr && order(lane) <= order(*most.lane))) {
      continue;
    }
    const auto first = std::ranges::find_if(lane.queue, [&](const PendingMessage& one) {
      return one.may_go() || (gives_way_first(lane) && !one.lent);
    });
    if (first != lane.queue.end()) {
      most = {&lane, first};
    }
  }
  return most;
}

// Of what has begun to leave, the one datagram went that asks for the host.
SendLanes::Queue::iterator SendLanes::large_like(Queue& queue, const Header& newer) {
  return std::ranges::find_if(queue, [&](const PendingMessage& one) {
    return !one.plain() && !one.lent && are_alike(one.header, newer);
  });
}

Room SendLanes::make_room(const Endpoint& to, const Header& newer, const WaitRule& rule) {
  if (rule.most == 0 || bytes_ == 0) {
    return {};
  }
  const auto lane = std::ranges::find(lanes_, to, &SendLane::to);
  if (lane == lanes_.end()) {
    return {};
  }
  if (lane->host && lane->queue.size() <= max_looked_through) {
    if (const auto large = large_like(lane->queue, newer); large != lane->queue.end()) {
      if (!rule.keep_oldest) {
        drop(*lane, large);
      }
      return {!rule.keep_oldest, 1};
    }
  }
  if (lane->queue.size() < rule.most) {
    return {};
  }
  if (lane->queue.size() > max_looked_through) {
    return {false, 1};
  }
  std::size_t like_it = 0;
  auto oldest = lane->queue.end();
  for (auto one = lane->queue.begin(); one != lane->queue.end(); ++one) {
    if (one->may_go() && !one->datagram && are_alike(one->header, newer)) {
      oldest = like_it++ == 0 ? one : oldest;
    }
  }
  if (like_it < rule.most) {
    return {};
  }
  if (rule.keep_oldest) {
    return {false, 1};
  }
  drop(*lane, oldest);
  return {true, 1};
}

void SendLanes::drop(SendLane& lane, Queue::iterator message) {
  discount(lane, message->bytes + place_bytes);
  dropped_.splice(dropped_.end(), lane.queue, message);
}

void SendLanes::let_go() {
  while (!dropped_.empty()) {
    reuse(dropped_);
  }
}

void SendLanes::own(PendingMessage& message) {
  for (std::size_t i = message.cursor.slice; i < message.slices.size(); ++i) {
    const ByteView rest = message.slices[i].subspan(std::exchange(message.cursor.offset, 0));
    message.copy.insert(message.copy.end(), rest.begin(), rest.end());
  }
  message.slices.assign(1, ByteView{message.copy});
  message.cursor = {};
}

void SendLanes::finish(SendLane& lane) {
  discount(lane, lane.queue.front().bytes + place_bytes);
  reuse(lane.queue);
}

// Keeps the place of the first one for reuse. The owner of that message is released last.
void SendLanes::reuse(Queue& from) {
  const auto done = from.begin();
  const std::shared_ptr<const void> kept = std::move(done->keep_alive);
  copies_.give_back(std::move(done->copy));
  if (unused_.size() == max_unused) {
    from.erase(done);
    return;
  }
  unused_.splice(unused_.begin(), from, done);
}

SendLane& SendLanes::await_host(const Endpoint& to, const AwaitedHost& host) {
  SendLane& lane = lane_of(to);
  lane.host = host;
  return lane;
}

SendLane* SendLanes::awaiting(const Endpoint& to) noexcept {
  const auto lane = std::ranges::find(lanes_, to, &SendLane::to);
  return lane != lanes_.end() && lane->host ? &*lane : nullptr;
}

std::size_t SendLanes::awaited() const noexcept {
  return static_cast<std::size_t>(
      std::ranges::count_if(lanes_, [](const SendLane& lane) { return lane.host.has_value(); }));
}

std::size_t SendLanes::give_up(SendLane& lane) {
  lane.host.reset();
  std::size_t messages = 0;
  while (!lane.queue.empty()) {
    messages += lane.queue.front().messages;
    drop(lane, lane.queue.begin());
  }
  return messages;
}

std::size_t SendLanes::clear() {
  std::size_t messages = 0;
  std::list<PendingMessage> dropped;  // their owners may call us
  for (SendLane& lane : lanes_) {
    for (const PendingMessage& message : lane.queue) {
      messages += message.messages;
    }
    dropped.splice(dropped.end(), lane.queue);
    discount(lane, lane.bytes);
  }
  return messages;
}

}  // namespace trestle::someip
