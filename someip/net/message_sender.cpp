#include "someip/net/message_sender.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/defer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstring>
#include <iterator>
#include <limits>
#include <list>
#include <optional>
#include <utility>
#include <vector>

#include "someip/net/datagram_batch.hpp"
#include "someip/net/handler_memory.hpp"
#include "someip/wire/slices.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t batch_segments = 64;  // what UdpSocket::send_segments() takes
constexpr std::size_t batch_bytes = 65000;
// In datagrams; each system call counts as one more. Where several receivers wait, none has more than a turn
// before others have theirs. After so much work the event loop runs, for all else that the thread does.
constexpr std::size_t turn_segments = 128;
constexpr std::size_t most_work = 512;
// No fragments on Ethernet.
constexpr std::size_t max_datagram_bytes = header_bytes + max_plain_payload_bytes;
constexpr std::size_t max_collections = 64;  // receivers for which messages are collected at the same time
constexpr Duration first_look = std::chrono::milliseconds{1};         // for an answer to ARP
constexpr Duration time_after_probe = std::chrono::milliseconds{10};  // in which the system asks for sure
constexpr Duration longest_look = std::chrono::milliseconds{100};
constexpr Duration untold_for =
    std::chrono::seconds{1};  // before it is asked again whether somebody can tell
// A host that was there is looked at again after this time, which limits what is sent to one that has gone
// since: the system keeps that for seconds, in the send buffer that all share. Sooner if much is sent there,
// while a large message leaves, and when the send buffer is full.
constexpr Duration look_pause = std::chrono::milliseconds{100};
constexpr Duration look_pause_much = std::chrono::milliseconds{10};
constexpr Duration look_pause_full = std::chrono::milliseconds{5};
constexpr Duration look_pause_large = std::chrono::milliseconds{1};
constexpr std::uint8_t much = 16;  // messages since the last look
// Small messages that handlers send which follow each other so closely are a stream. After so many turns of
// the event loop they leave together, with pauses no longer than that.
constexpr Duration stream_pause = std::chrono::microseconds{20};
constexpr unsigned stream_turns = 4;
constexpr std::size_t slices_per_segment = 2;  // a segment in more pieces is copied into one

// A host that was there when it was looked at, or of which nobody can tell.
struct Known {
  IpAddress address{};
  TimePoint looked{};
  Neighbours::Answer answer = Neighbours::Answer::untold;  ///< `unasked`: it is reached in another way
  std::uint8_t sent = 0;  ///< messages since, no more than `much` are counted

  [[nodiscard]] bool fresh(const IpAddress& host, TimePoint now, Duration pause) const noexcept {
    return host == address && now < looked + (answer == Neighbours::Answer::untold ? untold_for : pause);
  }
};

// The time of the system's last tick, which costs much less than the exact one.
TimePoint coarse_now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC_COARSE, &time);
  return TimePoint{std::chrono::seconds{time.tv_sec} + std::chrono::nanoseconds{time.tv_nsec}};
}

// Small messages to one receiver that leave in one datagram.
struct Collection {
  Endpoint to{};
  std::vector<std::byte> datagram{};
  std::size_t messages = 0;
};

}  // namespace

struct MessageSender::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& context, UdpSocket& via, std::size_t max_bytes, Duration collecting)
      : io{context},
        socket{&via},
        lanes{max_bytes, context},
        collect_for{collecting},
        timer{context},
        collect_timer{context} {}

  // --- collecting ---

  void collect(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
               std::size_t bytes) {
    std::list<Collection> full;
    auto one = collection_for(to);
    if (one != collections.end() && one->datagram.size() + header_bytes + bytes > max_datagram_bytes) {
      full.splice(full.end(), collections, one);
      one = add_collection(to);
    } else if (one == collections.end()) {
      if (collections.size() == max_collections) {
        send_all_collected();
      }
      if (!collects) {
        start_collecting();
      }
      one = add_collection(to);
    }
    std::vector<std::byte>& datagram = one->datagram;
    const std::size_t begin = datagram.size();
    datagram.resize(begin + header_bytes);
    static_cast<void>(encode_header(header, bytes, ByteSpan{datagram}.subspan(begin)));
    for (const ByteView slice : payload) {
      datagram.insert(datagram.end(), slice.begin(), slice.end());
    }
    ++one->messages;
    if (!full.empty()) {
      send_first_of(full);
    }
  }

  std::list<Collection>::iterator collection_for(const Endpoint& to) {
    return std::find_if(collections.begin(), collections.end(),
                        [&](const Collection& one) { return one.to == to; });
  }

  std::list<Collection>::iterator add_collection(const Endpoint& to) {
    if (spare_collections.empty()) {
      spare_collections.emplace_back().datagram.reserve(max_datagram_bytes);
    }
    collections.splice(collections.end(), spare_collections, spare_collections.begin());
    const auto one = std::prev(collections.end());
    one->to = to;
    one->messages = 0;
    one->datagram.clear();
    return one;
  }

  void start_collecting() {
    collects = true;
    collect_timer.expires_after(collect_for);
    collect_timer.async_wait(memory->collect.hold(
        [weak = weak_from_this(), keep = memory](const boost::system::error_code& error) {
          const auto self = weak.lock();
          if (!error && self && self->socket != nullptr) {
            self->collects = false;
            self->send_all_collected();
          }
        }));
  }

  void send_collected(const Collection& one) {
    const ByteView datagram{one.datagram};
    if (turn_open) {
      const ByteSpan place = place_in_batch(one.to, datagram.size(), one.messages);
      std::copy(datagram.begin(), datagram.end(), place.begin());
      return;
    }
    const SendStatus status = send_datagram(one.to, datagram, one.messages);
    if (status == SendStatus::would_block) {
      enqueue_datagram(one.to, datagram, one.messages);
    } else if (status == SendStatus::failed) {
      counters.refused += one.messages;
    }
  }

  void send_first_of(std::list<Collection>& leaving) {
    send_collected(leaving.front());
    spare_collections.splice(spare_collections.begin(), leaving, leaving.begin());
  }

  void send_all_collected() {
    // Moved out first: when a message has been sent, its owner may send another one.
    std::list<Collection> leaving = std::exchange(collections, {});
    while (!leaving.empty()) {
      send_first_of(leaving);
      turn_open = true;
    }
    end_turn();
  }

  // Sends what is collected for this receiver, before any later message.
  void send_collected_for(const Endpoint& to) {
    const auto one = collection_for(to);
    if (one != collections.end()) {
      std::list<Collection> leaving;
      leaving.splice(leaving.end(), collections, one);
      send_first_of(leaving);
    }
  }

  template <typename Call>
  auto counted(Call call) {
    const UdpSendCounters before = socket->send_counters();
    const auto result = call();
    const std::uint64_t calls = socket->send_counters().calls - before.calls;
    counters.system_calls += calls;
    work += calls;
    counters.offload_refused += socket->send_counters().offload_refused - before.offload_refused;
    return result;
  }

  // --- small ones together ---

  // From now on small messages wait for each other: until the running handler ends, or until all messages
  // that the socket has received at once have been handled.
  void open_turn() {
    turn_open = true;
    if (!socket->receiving() && !deferred) {  // otherwise end_turn() will be called
      defer_end();
    }
  }

  // Once all handlers have run that are ready now.
  void defer_end() {
    deferred = true;
    boost::asio::defer(io, memory->defer.hold([weak = weak_from_this(), keep = memory] {
      const auto self = weak.lock();
      if (self && self->socket != nullptr) {
        self->deferred = false;
        self->end_turn_or_stream();
      }
    }));
  }

  // A turn stays open, and what it sends waits, while handlers send without a break.
  void end_turn_or_stream() {
    const TimePoint now = std::chrono::steady_clock::now();
    const bool goes_on = std::exchange(sent_in_turn, false) && now - turn_end < stream_pause;
    turn_end = now;
    turns = goes_on ? turns + 1 : 0;
    if (turns < stream_turns) {
      end_turn();
      return;
    }
    if (now - flushed >= stream_pause) {
      flush();
      flushed = now;
    }
    defer_end();
  }

  void end_turn() {
    flush();
    turn_open = false;
  }

  ByteSpan place_in_batch(const Endpoint& to, std::size_t bytes, std::size_t messages) {
    if (!batch.has_room(bytes)) {
      flush();
    }
    return batch.add(to, bytes, messages);
  }

  void add_to_batch(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
                    std::size_t bytes) {
    const ByteSpan place = place_in_batch(to, header_bytes + bytes, 1);
    static_cast<void>(encode_header(header, bytes, place));
    auto end = place.begin() + header_bytes;
    for (const ByteView slice : payload) {
      end = std::copy(slice.begin(), slice.end(), end);
    }
  }

  void flush() {
    const auto entries = batch.entries();
    bool some_wait = false;
    for (std::size_t next = 0; next < entries.size();) {
      const UdpSocket::Batch sent = counted([&] { return socket->send_trains(batch.trains(next)); });
      for (const std::size_t end = next + sent.sent; next < end; ++next) {
        counters.messages += entries[next].messages;
        ++counters.datagrams;
      }
      if (sent.status == SendStatus::failed) {
        counters.refused += entries[next++].messages;
      } else if (sent.status == SendStatus::would_block) {
        for (; next < entries.size(); ++next) {
          put_datagram(entries[next].to, batch.bytes_of(entries[next]), entries[next].messages);
          some_wait = true;
        }
      }
    }
    batch.clear();
    if (some_wait) {
      start();  // not before: the owner of a message that leaves may send others
    }
  }

  // --- sending ---

  // While this object lives, a message is sent from the caller's memory; if it waits then, it is copied.
  struct Lending {
    Lending(State& of, PendingMessage& message) : state{of.shared_from_this()} {
      state->lent = &message;
      message.lent = true;
    }
    ~Lending() {
      if (state->lent != nullptr) {
        state->lent->lent = false;
        SendLanes::own(*std::exchange(state->lent, nullptr));
      }
    }
    Lending(const Lending&) = delete;
    Lending& operator=(const Lending&) = delete;
    std::shared_ptr<State> state;  // the owner of another message may destroy the sender
  };

  SendStatus send_datagram(const Endpoint& to, std::span<const ByteView> parts, std::size_t messages) {
    const SendStatus status = counted([&] { return socket->send(to, parts); });
    if (status == SendStatus::sent) {
      counters.messages += messages;
      ++counters.datagrams;
      ++work;
    }
    return status;
  }
  SendStatus send_datagram(const Endpoint& to, ByteView datagram, std::size_t messages) {
    return send_datagram(to, {&datagram, 1}, messages);
  }

  SendStatus send_plain(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
                        std::size_t bytes) {
    // A small message in many pieces is copied into one: cheaper than a long list for the kernel.
    std::array<std::byte, header_bytes + max_plain_payload_bytes> datagram;
    static_cast<void>(encode_header(header, bytes, datagram));
    std::array<ByteView, 2> parts{ByteView{datagram}.first(header_bytes), {}};
    if (payload.size() == 1) {
      parts[1] = payload.front();
    } else {
      auto end = datagram.begin() + header_bytes;
      for (const ByteView slice : payload) {
        end = std::copy(slice.begin(), slice.end(), end);
      }
      parts[0] = ByteView{datagram}.first(header_bytes + bytes);
    }
    return send_datagram(to, parts, 1);
  }

  // Sends the next segments of `message`, `room` at most, with one system call. At least one is left.
  SendStatus send_batch(SendLane& lane, PendingMessage& message, std::size_t room) {
    const std::size_t datagram_bytes = header_bytes + tp_header_bytes + message.segments.segment_bytes();
    const std::size_t most =
        std::max<std::size_t>(1, std::min({batch_segments, batch_bytes / datagram_bytes, room}));
    const TpSegmenter segments_before = message.segments;
    const SliceCursor cursor_before = message.cursor;
    slices.clear();
    slice_counts.clear();
    flat_used = 0;
    while (slice_counts.size() < most) {
      const auto segment = message.segments.next();
      if (!segment) {
        break;
      }
      std::array<std::byte, 20>& header = headers[slice_counts.size()];
      header = segment->header;
      slices.emplace_back(header);
      const std::size_t first = slices.size();
      take(message.slices, message.cursor, segment->bytes, slices);
      if (slices.size() - first > slices_per_segment) {
        join(first, segment->bytes);
      }
      slice_counts.push_back(static_cast<std::uint8_t>(1 + slices.size() - first));
    }
    const UdpSocket::Batch result =
        counted([&] { return socket->send_segments(lane.to, slices, slice_counts, datagram_bytes); });
    counters.datagrams += result.sent;
    work += result.sent;
    lane.pace.sent(result.sent);
    message.begun |= result.sent > 0;
    if (result.sent < slice_counts.size()) {  // go back to the first segment that was not sent
      message.segments = segments_before;
      message.cursor = cursor_before;
      for (std::size_t i = 0; i < result.sent; ++i) {
        slices.clear();
        take(message.slices, message.cursor, message.segments.next()->bytes, slices);
      }
    }
    return result.status;
  }

  // Replaces the slices from `first` on by one copy of them.
  void join(std::size_t first, std::size_t bytes) {
    if (!flat) {
      flat.reset(new std::byte[batch_bytes]);
    }
    const ByteSpan place{flat.get() + flat_used, bytes};
    std::size_t at = 0;
    for (std::size_t i = first; i < slices.size(); ++i) {
      std::memcpy(place.data() + at, slices[i].data(), slices[i].size());
      at += slices[i].size();
    }
    slices.resize(first);
    slices.emplace_back(place);
    flat_used += bytes;
  }

  // Sends what may leave now, at most one burst of each lane, in rounds; then the event loop runs again. It
  // runs earlier when there is much to send.
  void pump() {
    if (std::exchange(pumping, true)) {
      again = true;  // the owner of a message that was sent has sent another one
      return;
    }
    const auto self = shared_from_this();
    std::optional<TimePoint> resume;
    work = 0;
    do {
      again = false;
      resume.reset();
      serve_each_address(resume);
    } while ((again || more) && !blocked && work < most_work);
    pumping = false;
    if (socket == nullptr) {
      return;
    }
    if (blocked) {
      look_at_all_that_wait();
      socket->wait_writable([this] {  // close() withdraws it
        blocked = false;
        pump();
      });
    } else if (again || more) {
      rests = true;
      wait_until(std::chrono::steady_clock::now());
    } else if (resume) {
      wait_until(*resume);
    }
    if (!gone.empty()) {
      let_go();
      tell_who_is_gone();
    }
  }

  // One round: a turn for each address for which something may leave.
  void serve_each_address(std::optional<TimePoint>& resume) {
    const TimePoint now = std::chrono::steady_clock::now();
    more = false;
    shared = lanes.waiting() > 1;
    if (shared) {
      lanes.begin_round();
    }
    auto next = lanes.all().begin();
    for (std::size_t left = lanes.all().size(); left > 0; --left) {
      const auto lane = next++;
      const bool over = work >= most_work || (shared && lane->share->served);
      if (over && may_leave(*lane, now)) {
        more = true;
        continue;
      }
      const std::size_t before = work;
      blocked = !serve(*lane, now, resume);
      if (work != before) {
        lane->share->served = true;
        lanes.put_last(lane);
      }
      if (blocked) {
        return;
      }
    }
  }

  // Whether it is only for its turn that it waits.
  bool may_leave(SendLane& lane, TimePoint now) {
    if (lane.host || lane.queue.empty()) {
      return false;
    }
    const PendingMessage& message = lane.queue.front();
    return message.plain() || segments_for(lane, now) > 0;
  }

  // How many segments of its first message may leave now, as its pacing says. Who has not told what it can
  // take may get more if it is on this host: up to half of the buffer of its socket is left to be read.
  std::size_t segments_for(SendLane& lane, TimePoint now) {
    const PendingMessage& message = lane.queue.front();
    const std::size_t paced = lane.pace.room(message.pacing, now);
    const bool is_here = lane.to.address.is_loopback() || lane.to.address == socket->local().address;
    if (paced > 0 || local_room == nullptr || message.pacing.burst || !is_here) {
      return paced;
    }
    const auto buffer = local_room->of(socket->local(), lane.to);
    if (!buffer || buffer->most <= 2 * buffer->unread) {
      return 0;
    }
    const std::size_t segments = burst_into(buffer->most - 2 * buffer->unread, 0).value_or(0);
    return segments >= default_burst ? segments : 0;  // fewer are not worth the question
  }

  void meet(const Endpoint& to) {
    using enum Neighbours::Answer;
    const Neighbours::Answer answer = link.answer_of ? link.answer_of(to.address) : untold;
    if (answer == came || answer == untold) {
      return;
    }
    const TimePoint now = std::chrono::steady_clock::now();
    lanes.await_host(to, {.since = now, .next_look = now + first_look, .pause = first_look});
    if (!pumping) {
      wait_until(now + first_look);
    }
  }

  void part(const Endpoint& to) {
    if (SendLane* const lane = lanes.awaiting(to)) {
      give_up(*lane);
      let_go();
    }
  }

  bool greet(const Endpoint& to) {
    if (!link.entry_of || place_of(to.address).fresh(to.address, coarse_now(), look_pause)) {
      return true;
    }
    if (const SendLane* const lane = lanes.awaiting(to)) {
      return lane->queue.size() < max_for_silent;
    }
    return look(to, max_silent);
  }

  // Before something is sent to a receiver that may have gone since it was looked at: what is for it waits
  // then. A look into a small table, if that was less than `pause` ago.
  void look_again(const Endpoint& to, TimePoint now, Duration pause) {
    const bool alone = !to.address.is_multicast();
    if (alone && !place_of(to.address).fresh(to.address, now, pause) && lanes.awaiting(to) == nullptr) {
      static_cast<void>(look(to, std::numeric_limits<std::size_t>::max()));
    }
  }

  void look_before_sending(const Endpoint& to) {
    if (link.entry_of) {
      Known& place = place_of(to.address);
      look_again(to, coarse_now(), place.sent < much ? look_pause : look_pause_much);
      place.sent = static_cast<std::uint8_t>(std::min<unsigned>(place.sent + 1U, much));
    }
  }

  // The send buffer is full, maybe of what is for hosts that have gone. What else waits for them stays here.
  void look_at_all_that_wait() {
    if (!link.entry_of) {
      return;
    }
    const TimePoint now = coarse_now();
    for (const SendLane& lane : lanes.all()) {
      if (!lane.host && !lane.queue.empty()) {
        look_again(lane.to, now, look_pause_full);
      }
    }
  }

  // What is sent to silent hosts, so that the system asks, must not fill the send buffer either.
  [[nodiscard]] bool may_probe() {
    return std::ranges::count_if(lanes.all(), [](const SendLane& lane) {
             return lane.host && (lane.host->probe || lane.host->probed);
           }) < static_cast<std::ptrdiff_t>(max_silent);
  }

  // Each host has one place, and shares it with others if there are many.
  Known& place_of(const IpAddress& host) {
    std::array<std::uint64_t, 2> words{};
    static_assert(sizeof words == sizeof host.bytes);
    std::memcpy(words.data(), host.bytes.data(), sizeof words);
    return known[((words[0] ^ (words[1] * 31)) * 0x9e3779b97f4a7c15U) >> 56U];
  }

  // Asks the system for the host. If it has not come, one datagram leaves for it, and the rest waits.
  // @return false if it has to wait, and so many others do already: nothing was done.
  bool look(const Endpoint& to, std::size_t most_awaited) {
    using enum Neighbours::Answer;
    const TimePoint now = std::chrono::steady_clock::now();
    Known& place = place_of(to.address);
    Neighbours::Answer answer = to.address == socket->local().address ? untold : link.entry_of(to.address);
    const bool silent = answer == awaited || answer == unasked;
    if (silent && lanes.awaited() >= most_awaited) {
      return false;
    }
    if (answer == unasked && !(place.address == to.address && place.answer == unasked)) {
      answer = link.answer_of(to.address);
      if (answer == unasked) {
        answer = awaited;
      }
    }
    if (answer != awaited) {
      place = {to.address, now, answer};
      return true;
    }
    lanes.await_host(
        to, {.since = now, .next_look = now + first_look, .pause = first_look, .probe = may_probe()});
    if (!pumping) {
      wait_until(now + first_look);
    }
    return true;
  }

  // Whether the receiver has answered to its address; the pauses between two looks grow.
  bool is_there(SendLane& lane, TimePoint now) {
    AwaitedHost& host = *lane.host;
    if (now < host.next_look) {
      return false;
    }
    using enum Neighbours::Answer;
    const Neighbours::Answer answer = link.answer_of(lane.to.address);
    host.asked = host.asked || answer == awaited;
    const bool never_asked = answer == unasked && !host.asked;
    if (answer == came || answer == untold ||
        (never_asked && host.probed && now - *host.probed >= time_after_probe)) {
      lane.host.reset();
      place_of(lane.to.address) = {lane.to.address, now, answer};
      return true;
    }
    if (now - host.since >= patience) {
      if (never_asked && lane.queue.empty()) {
        lane.host.reset();  // nothing was to be sent, so nobody knows
        return true;
      }
      gone.push_back(lane.to);
      give_up(lane);
      return true;
    }
    if (never_asked && !host.probe && !host.probed && now - host.since >= time_to_ask) {
      host.probe = may_probe();  // the answer to its subscription has not left: discovery may wait for room
    }
    host.pause = std::min(2 * host.pause, longest_look);
    host.next_look = now + host.pause;
    return false;
  }

  // Drops all that waits there. Of a message that is just being sent nobody needs a copy any more.
  void give_up(SendLane& lane) {
    if (lent != nullptr &&
        std::ranges::any_of(lane.queue, [&](const PendingMessage& one) { return &one == lent; })) {
      lent = nullptr;
    }
    counters.refused += lanes.give_up(lane);
  }

  void tell_who_is_gone() {
    for (const Endpoint& receiver : std::exchange(gone, {})) {
      link.unreachable(receiver);
      if (socket == nullptr) {
        return;
      }
    }
  }

  // Sends what waits until a burst or its turn is over, or nothing is left.
  // @return false when the socket is full.
  bool serve(SendLane& lane, TimePoint now, std::optional<TimePoint>& resume) {
    if (link.entry_of && !lane.queue.empty() && !lane.queue.front().plain()) {
      look_again(lane.to, now, look_pause_large);
    }
    const bool waits = lane.host && !is_there(lane, now);
    if (waits) {
      resume = resume ? std::min(*resume, lane.host->next_look) : lane.host->next_look;
    }
    const std::size_t end = work + (shared ? turn_segments : 2 * most_burst);
    std::size_t room = 0;  // in segments, that is left of what may leave at once
    while (!lane.queue.empty() && (!waits || lane.host->probe)) {
      PendingMessage& message = lane.queue.front();
      if (work >= end && (room > 0 || may_leave(lane, now))) {
        more = true;
        return true;
      }
      SendStatus status = SendStatus::sent;
      if (message.datagram) {
        status = send_datagram(lane.to, message.slices.front(), message.messages);
      } else if (message.plain()) {
        status = send_plain(lane.to, message.header, message.slices, message.bytes);
      } else if (room = room > 0 ? room : segments_for(lane, now); room > 0) {
        const std::uint64_t before = counters.datagrams;
        status = send_batch(lane, message, waits ? 1 : std::min(room, end - work));
        room -= std::min<std::size_t>(room, counters.datagrams - before);
      } else {
        const TimePoint next = lane.pace.resume(message.pacing);
        resume = resume ? std::min(*resume, next) : next;
        return true;
      }
      if (status == SendStatus::would_block) {
        return false;
      }
      if (waits) {
        lane.host->probe = false;
        lane.host->probed = now;
      }
      if (status == SendStatus::failed) {
        counters.refused += message.messages;
      } else if (!message.plain()) {
        if (!message.segments.done()) {
          continue;
        }
        ++counters.messages;
      }
      if (&message == lent) {
        lent = nullptr;
      }
      room = 0;  // the next one may have another pacing
      lanes.finish(lane);
    }
    return true;
  }

  // Does not touch a timer that fires earlier: pump() finds out what is due.
  void wait_until(TimePoint time) {
    if (wakes && *wakes <= time) {
      return;
    }
    timer.expires_at(time);
    timer.async_wait(
        memory->pace.hold([weak = weak_from_this(), keep = memory](const boost::system::error_code& error) {
          const auto self = weak.lock();
          if (!error && self && self->socket != nullptr) {
            self->wakes.reset();
            self->rests = false;
            self->pump();
          }
        }));
    wakes = time;
  }

  bool enqueue(const Endpoint& to, const Header& header, std::span<const ByteView> payload, std::size_t bytes,
               std::shared_ptr<const void> keep_alive, const TpPacing& pacing) {
    const auto self = shared_from_this();  // the owner of another message may destroy the sender
    if (bytes > large_above) {
      large_above = std::numeric_limits<std::size_t>::max();
      std::exchange(on_large, nullptr)();
    }
    PendingMessage* const place = lanes.add(to, payload, bytes, keep_alive != nullptr);
    if (on_full && (place == nullptr || lanes.some_gave_way())) {
      on_full(to);
    }
    if (place == nullptr) {
      ++counters.queue_full;
      let_go();
      return false;
    }
    place->header = header;
    place->keep_alive = std::move(keep_alive);
    place->pacing = pacing;
    place->segments = TpSegmenter{header, bytes, pacing.segment_bytes};
    place->messages = 1;
    place->datagram = false;
    if (place->keep_alive == nullptr && !pumping && !blocked && !rests) {
      const Lending lending{*this, *place};
      pump();
    } else {
      if (place->keep_alive == nullptr) {
        SendLanes::own(*place);  // nothing of it leaves during this call
      }
      start();
    }
    let_go();
    return true;
  }

  // Releases messages that gave way to newer ones.
  void let_go() {
    if (lanes.some_gave_way()) {
      const auto self = shared_from_this();
      lanes.let_go();
    }
  }

  void enqueue_datagram(const Endpoint& to, ByteView datagram, std::size_t messages) {
    put_datagram(to, datagram, messages);
    start();
  }

  void put_datagram(const Endpoint& to, ByteView datagram, std::size_t messages) {
    PendingMessage* const place = lanes.add(to, {&datagram, 1}, datagram.size(), false);
    if (on_full && (place == nullptr || lanes.some_gave_way())) {
      on_full(to);
    }
    if (place == nullptr) {
      counters.queue_full += messages;
      return;
    }
    place->messages = messages;
    place->datagram = true;
    SendLanes::own(*place);
  }

  void start() {
    const auto self = shared_from_this();
    if (!blocked && !rests) {
      pump();
    }
    let_go();
  }

  struct Memory {
    HandlerMemory collect;
    HandlerMemory defer;
    HandlerMemory pace;
  };

  boost::asio::io_context& io;
  UdpSocket* socket;
  SendLanes lanes;
  Duration collect_for;
  std::shared_ptr<Memory> memory = std::make_shared<Memory>();  ///< the handlers keep it
  boost::asio::steady_timer timer;
  std::optional<TimePoint> wakes;  ///< when the timer calls pump()
  boost::asio::steady_timer collect_timer;
  bool collects = false;  ///< collect_timer runs; what is collected meanwhile may leave earlier
  std::list<Collection> collections;
  std::list<Collection> spare_collections;  ///< kept to reuse their memory
  bool pumping = false;                     ///< pump() is being called
  bool again = false;                       ///< and has to start again
  bool more = false;                        ///< some that may leave wait for their turn
  bool shared = false;                      ///< several receivers wait
  std::size_t work = 0;                     ///< of this pump(): datagrams and system calls
  bool blocked = false;                     ///< the socket is full and will call pump()
  bool rests = false;                       ///< until the event loop has run: the timer calls pump()
  PendingMessage* lent = nullptr;           ///< this message waits in the memory of the caller of send()
  DatagramBatch batch;
  bool turn_open = false;     ///< a small message has left, further ones wait for each other in the batch
  bool deferred = false;      ///< end_turn_or_stream() has been posted
  bool sent_in_turn = false;  ///< a small message
  TimePoint turn_end{};       ///< of the last one
  unsigned turns = 0;         ///< one after the other, each of which has sent something
  TimePoint flushed{};        ///< when that was, within a stream
  Counters counters;
  std::size_t large_above = std::numeric_limits<std::size_t>::max();
  std::function<void()> on_large;
  std::function<void(const Endpoint& to)> on_full;
  Link link;
  LocalRoom* local_room = nullptr;
  std::vector<Endpoint> gone;      ///< still to be reported
  std::array<Known, 256> known{};  ///< each at a place that follows from its address
  // Of one batch; kept to reuse their memory.
  std::array<std::array<std::byte, header_bytes + tp_header_bytes>, batch_segments> headers{};
  std::vector<ByteView> slices;
  std::vector<std::uint8_t> slice_counts;
  std::unique_ptr<std::byte[]> flat;
  std::size_t flat_used = 0;
};

MessageSender::MessageSender(boost::asio::io_context& io, UdpSocket& socket, std::size_t max_queued_bytes,
                             Duration collect_for)
    : state_{std::make_shared<State>(io, socket, max_queued_bytes, collect_for)} {
  socket.after_receiving([weak = std::weak_ptr{state_}] {
    if (const auto self = weak.lock(); self && self->socket != nullptr) {
      self->end_turn();
    }
  });
}

MessageSender::~MessageSender() {
  close();
}

void MessageSender::watch_link(Link link) {
  state_->link = std::move(link);
}

void MessageSender::ask_for_room(LocalRoom& room) {
  state_->local_room = &room;
}

void MessageSender::meet(const Endpoint& receiver) {
  if (state_->socket != nullptr) {
    state_->meet(receiver);
  }
}

void MessageSender::part(const Endpoint& receiver) {
  if (state_->socket != nullptr) {
    state_->part(receiver);
  }
}

bool MessageSender::greet(const Endpoint& receiver) {
  return state_->socket == nullptr || state_->greet(receiver);
}

void MessageSender::flush() {
  if (state_->socket != nullptr) {
    state_->flush();
  }
}

void MessageSender::close() {
  State& state = *state_;
  if (state.socket == nullptr) {
    return;
  }
  state.flush();
  state.send_all_collected();
  state.socket->wait_writable(nullptr);
  state.socket = nullptr;
  state.timer.cancel();
  state.collect_timer.cancel();
  state.lent = nullptr;
  state.counters.abandoned += state.lanes.clear();
}

void MessageSender::tell_large(std::size_t above, std::function<void()> told) {
  state_->large_above = above;
  state_->on_large = std::move(told);
}

void MessageSender::tell_full(std::function<void(const Endpoint& to)> told) {
  state_->on_full = std::move(told);
}

bool MessageSender::send(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
                         std::shared_ptr<const void> keep_alive, const TpPacing& pacing) {
  State& state = *state_;
  if (state.socket == nullptr) {
    ++state.counters.abandoned;
    return false;
  }
  state.look_before_sending(to);
  const std::size_t bytes = size_of(payload);
  const bool to_collect = state.collect_for > Duration::zero();
  if (bytes <= max_plain_payload_bytes && !state.lanes.must_wait(to, header)) {
    if (to_collect) {
      state.collect(to, header, payload, bytes);
      return true;
    }
    state.sent_in_turn = true;
    if (state.turn_open) {
      state.add_to_batch(to, header, payload, bytes);
      return true;
    }
    const SendStatus status = state.send_plain(to, header, payload, bytes);
    if (status == SendStatus::sent) {
      state.open_turn();
    }
    if (status != SendStatus::would_block) {
      state.counters.refused += status == SendStatus::failed ? 1 : 0;
      return status == SendStatus::sent;
    }
  }
  state.flush();
  if (to_collect) {
    state.send_collected_for(to);
  }
  return state.enqueue(to, header, payload, bytes, std::move(keep_alive), pacing);
}

bool MessageSender::is_full_for(const Endpoint& to, std::size_t bytes) const {
  return state_->socket != nullptr && state_->lanes.is_full_for(to, bytes);
}

Room MessageSender::make_room(const Endpoint& to, const Header& newer, const WaitRule& rule) {
  const Room room = state_->lanes.make_room(to, newer, rule);
  state_->counters.overtaken += room.dropped;
  state_->let_go();
  return room;
}

bool MessageSender::idle() const noexcept {
  return state_->lanes.empty() && state_->collections.empty() && state_->batch.empty();
}
MessageSender::Counters MessageSender::counters() const noexcept {
  Counters result = state_->counters;
  result.queue_full += state_->lanes.gave_way();
  return result;
}

}  // namespace trestle::someip
