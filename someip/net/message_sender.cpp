#include "someip/net/message_sender.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstring>
#include <deque>
#include <numeric>
#include <utility>
#include <vector>

#include "someip/core/tp_segmenter.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t batch_segments = 64;  // what UdpSocket::send_segments() takes
constexpr std::size_t batch_bytes = 65000;
constexpr std::size_t max_datagram_bytes =
    header_bytes + max_plain_payload_bytes;    // no fragments on Ethernet
constexpr std::size_t max_collections = 64;    // receivers that messages are collected for at once
constexpr std::size_t slices_per_segment = 2;  // a segment that lies in more pieces is copied together

// Where in a list of slices the next byte is.
struct SliceCursor {
  std::size_t slice = 0;
  std::size_t offset = 0;
};

struct Pending {
  Endpoint to;
  Header header;
  std::vector<ByteView> slices;
  std::size_t bytes = 0;
  std::shared_ptr<const void> keep_alive;
  TpPacing pacing;
  TpSegmenter segments;
  SliceCursor cursor;
  std::size_t burst_left = 0;
  std::size_t messages = 1;  ///< more: the slices are a datagram with so many, headers and all

  [[nodiscard]] bool plain() const noexcept { return bytes <= max_plain_payload_bytes; }
};

// Small messages to one receiver that leave in one datagram.
struct Collection {
  Endpoint to;
  std::vector<std::byte> datagram{};
  std::size_t messages = 0;
};

// Takes the next `bytes` bytes as views. There are that many.
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

std::size_t size_of(std::span<const ByteView> slices) {
  return std::accumulate(slices.begin(), slices.end(), std::size_t{0},
                         [](std::size_t sum, ByteView slice) { return sum + slice.size(); });
}

}  // namespace

struct MessageSender::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& io, UdpSocket& via, std::size_t max_bytes, Duration collecting)
      : socket{&via}, max_queued_bytes{max_bytes}, collect_for{collecting}, timer{io}, collect_timer{io} {}

  // --- collecting ---

  void collect(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
               std::size_t bytes) {
    auto one = std::find_if(collections.begin(), collections.end(),
                            [&](const Collection& other) { return other.to == to; });
    if (one != collections.end() && one->datagram.size() + header_bytes + bytes > max_datagram_bytes) {
      send_collected(*one);
      *one = Collection{.to = to};
    } else if (one == collections.end()) {
      if (collections.size() == max_collections) {
        send_all_collected();
      }
      if (collections.empty()) {
        start_collecting();
      }
      one = collections.insert(collections.end(), Collection{.to = to});
    }
    std::vector<std::byte>& datagram = one->datagram;
    const std::size_t begin = datagram.size();
    datagram.resize(begin + header_bytes);
    static_cast<void>(encode_header(header, bytes, ByteSpan{datagram}.subspan(begin)));
    for (const ByteView slice : payload) {
      datagram.insert(datagram.end(), slice.begin(), slice.end());
    }
    ++one->messages;
  }

  void start_collecting() {
    collect_timer.expires_after(collect_for);
    collect_timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (!error && self && self->socket != nullptr) {
        self->send_all_collected();
      }
    });
  }

  void send_collected(const Collection& one) {
    const ByteView datagram{one.datagram};
    const SendStatus status = send_datagram(one.to, datagram, one.messages);
    if (status == SendStatus::would_block) {
      enqueue({.to = one.to,
               .header = {},
               .slices = {datagram},
               .bytes = datagram.size(),
               .keep_alive = nullptr,
               .pacing = {},
               .segments = TpSegmenter{{}, 0, tp_default_segment_bytes},
               .cursor = {},
               .burst_left = 0,
               .messages = one.messages});
    } else if (status == SendStatus::failed) {
      counters.refused += one.messages;
    }
  }

  void send_all_collected() {
    for (const Collection& one : std::exchange(collections, {})) {
      send_collected(one);
    }
  }

  // What is collected for this receiver goes before what follows.
  void send_collected_for(const Endpoint& to) {
    const auto one = std::find_if(collections.begin(), collections.end(),
                                  [&](const Collection& other) { return other.to == to; });
    if (one != collections.end()) {
      const Collection last = std::move(*one);
      collections.erase(one);
      send_collected(last);
    }
  }

  SendStatus send_datagram(const Endpoint& to, ByteView datagram, std::size_t messages) {
    const SendStatus status = socket->send(to, {&datagram, 1});
    if (status == SendStatus::sent) {
      counters.messages += messages;
      ++counters.datagrams;
    }
    return status;
  }

  // --- sending ---

  SendStatus send_plain(const Endpoint& to, const Header& header, std::span<const ByteView> payload) {
    // A small message in many pieces is copied together: cheaper than a long list for the kernel.
    std::array<std::byte, header_bytes + max_plain_payload_bytes> datagram;
    static_cast<void>(encode_header(header, size_of(payload), datagram));
    std::array<ByteView, 2> parts{ByteView{datagram}.first(header_bytes), {}};
    if (payload.size() == 1) {
      parts[1] = payload.front();
    } else {
      std::size_t end = header_bytes;
      for (const ByteView slice : payload) {
        std::copy(slice.begin(), slice.end(), datagram.begin() + static_cast<std::ptrdiff_t>(end));
        end += slice.size();
      }
      parts[0] = ByteView{datagram}.first(end);
    }
    const SendStatus status = socket->send(to, parts);
    if (status == SendStatus::sent) {
      ++counters.messages;
      ++counters.datagrams;
    }
    return status;
  }

  // Sends the next segments of `message` with one system call. At least one segment is left.
  SendStatus send_batch(Pending& message) {
    const std::size_t datagram_bytes = header_bytes + tp_header_bytes + message.segments.segment_bytes();
    const std::size_t most = std::max<std::size_t>(
        1, std::min({batch_segments, batch_bytes / datagram_bytes, message.burst_left}));
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
    const UdpSocket::Batch batch = socket->send_segments(message.to, slices, slice_counts, datagram_bytes);
    counters.datagrams += batch.sent;
    message.burst_left -= std::min(message.burst_left, batch.sent);
    if (batch.sent < slice_counts.size()) {  // go back to the first segment that was not sent
      message.segments = segments_before;
      message.cursor = cursor_before;
      for (std::size_t i = 0; i < batch.sent; ++i) {
        slices.clear();
        take(message.slices, message.cursor, message.segments.next()->bytes, slices);
      }
    }
    return batch.status;
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

  // Sends what waits until a burst is over, the socket is full or nothing is left.
  void pump() {
    while (!queue.empty()) {
      Pending& message = queue.front();
      const SendStatus status = message.messages > 1
                                    ? send_datagram(message.to, message.slices.front(), message.messages)
                                : message.plain() ? send_plain(message.to, message.header, message.slices)
                                                  : send_batch(message);
      if (status == SendStatus::would_block) {
        socket->wait_writable(resume());
        return;
      }
      if (status == SendStatus::failed) {
        counters.refused += message.messages;
      } else if (!message.plain() && !message.segments.done()) {
        if (message.burst_left > 0) {
          continue;
        }
        message.burst_left = message.pacing.burst;
        if (message.pacing.separation > Duration::zero()) {
          pause(message.pacing.separation);
          return;
        }
        continue;
      } else if (!message.plain()) {
        ++counters.messages;
      }
      const bool paced = !message.plain();
      const Duration separation = message.pacing.separation;
      queued_bytes -= message.bytes;
      queue.pop_front();
      // The receiver needs its pause before another large message too.
      if (paced && separation > Duration::zero() && !queue.empty()) {
        pause(separation);
        return;
      }
    }
    busy = false;
  }

  void pause(Duration separation) {
    // From the burst before: a late timer must not slow the stream down for good.
    const auto now = std::chrono::steady_clock::now();
    next_burst = std::max(next_burst + separation, now);
    timer.expires_at(next_burst);
    timer.async_wait([self = shared_from_this(), step = resume()](const boost::system::error_code& error) {
      if (!error) {
        step();
      }
    });
  }

  std::function<void()> resume() {
    return [weak = weak_from_this()] {
      if (const auto self = weak.lock(); self && self->socket != nullptr) {
        self->pump();
      }
    };
  }

  [[nodiscard]] bool must_wait(const Endpoint& to, const Header& header) const {
    return std::any_of(queue.begin(), queue.end(), [&](const Pending& pending) {
      return pending.to == to && (pending.messages > 1 || (pending.header.service == header.service &&
                                                           pending.header.method == header.method));
    });
  }

  bool enqueue(Pending message) {
    if (message.bytes > max_queued_bytes - queued_bytes) {
      counters.queue_full += message.messages;
      return false;
    }
    if (!message.keep_alive) {
      auto copy = std::make_shared<std::vector<std::byte>>();
      copy->reserve(message.bytes);
      for (const ByteView slice : message.slices) {
        copy->insert(copy->end(), slice.begin(), slice.end());
      }
      message.slices.assign(1, ByteView{*copy});
      message.keep_alive = std::move(copy);
    }
    queued_bytes += message.bytes;
    queue.push_back(std::move(message));
    if (!busy) {
      busy = true;
      next_burst = std::chrono::steady_clock::now();
      pump();
    }
    return true;
  }

  UdpSocket* socket;
  std::size_t max_queued_bytes;
  std::size_t queued_bytes = 0;
  Duration collect_for;
  boost::asio::steady_timer timer;
  boost::asio::steady_timer collect_timer;
  std::vector<Collection> collections;
  std::chrono::steady_clock::time_point next_burst;
  bool busy = false;  ///< a timer or the socket will call pump()
  std::deque<Pending> queue;
  Counters counters;
  // Of one batch; kept to reuse their memory.
  std::array<std::array<std::byte, header_bytes + tp_header_bytes>, batch_segments> headers{};
  std::vector<ByteView> slices;
  std::vector<std::uint8_t> slice_counts;
  std::unique_ptr<std::byte[]> flat;
  std::size_t flat_used = 0;
};

MessageSender::MessageSender(boost::asio::io_context& io, UdpSocket& socket, std::size_t max_queued_bytes,
                             Duration collect_for)
    : state_{std::make_shared<State>(io, socket, max_queued_bytes, collect_for)} {}

MessageSender::~MessageSender() {
  close();
}

void MessageSender::close() {
  if (state_->socket != nullptr) {
    state_->send_all_collected();
  }
  state_->socket = nullptr;
  state_->timer.cancel();
  state_->collect_timer.cancel();
  for (const Pending& message : state_->queue) {
    state_->counters.abandoned += message.messages;
  }
  state_->queue.clear();  // now, for the cancelled handler keeps the state alive a little longer
  state_->queued_bytes = 0;
}

bool MessageSender::send(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
                         std::shared_ptr<const void> keep_alive, const TpPacing& pacing) {
  State& state = *state_;
  if (state.socket == nullptr) {
    ++state.counters.abandoned;
    return false;
  }
  const std::size_t bytes = size_of(payload);
  const bool collects = state.collect_for > Duration::zero();
  if (bytes <= max_plain_payload_bytes && !state.must_wait(to, header)) {
    if (collects) {
      state.collect(to, header, payload, bytes);
      return true;
    }
    const SendStatus status = state.send_plain(to, header, payload);
    if (status != SendStatus::would_block) {
      state.counters.refused += status == SendStatus::failed ? 1 : 0;
      return status == SendStatus::sent;
    }
  }
  if (collects) {
    state.send_collected_for(to);
  }
  return state.enqueue({.to = to,
                        .header = header,
                        .slices = {payload.begin(), payload.end()},
                        .bytes = bytes,
                        .keep_alive = std::move(keep_alive),
                        .pacing = pacing,
                        .segments = TpSegmenter{header, bytes, pacing.segment_bytes},
                        .cursor = {},
                        .burst_left = pacing.burst});
}

bool MessageSender::idle() const noexcept {
  return state_->queue.empty() && state_->collections.empty();
}
const MessageSender::Counters& MessageSender::counters() const noexcept {
  return state_->counters;
}

}  // namespace trestle::someip
