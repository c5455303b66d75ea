// Datagrams one way, as many as the system takes: the floor of calls in flight and of small events, and with
// full ones of the bare TP loop.
// Each with a buffer of its own (sendmmsg or sendto, recvmmsg), or as trains that the system takes apart
// (UDP_SEGMENT) and hands over whole (UDP_GRO). The first bytes of each are its number.
#include <netinet/udp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "test/bench/floor.hpp"

namespace trestle::floor {
namespace {

constexpr std::size_t batch = 32;
/// Datagrams of a train, and bytes: no kernel takes less.
constexpr std::size_t most_in_train = 64;
constexpr std::size_t most_bytes_in_train = 65'507;
constexpr std::size_t trains_at_once = 8;
constexpr std::size_t train_room = 65536;

/// What a receiver asks for.
struct Request {
  double seconds = 0;
  bool segmentation = true;
  bool batches = true;
};

/// Buffers for `count` messages.
template <std::size_t count>
class Batch {
 public:
  explicit Batch(std::size_t bytes) : bytes_(count * bytes), each_{bytes} {
    for (std::size_t i = 0; i < count; ++i) {
      parts_[i] = {at(i), bytes};
      messages_[i].msg_hdr.msg_iov = &parts_[i];
      messages_[i].msg_hdr.msg_iovlen = 1;
    }
  }
  [[nodiscard]] std::byte* at(std::size_t i) noexcept { return bytes_.data() + i * each_; }
  [[nodiscard]] std::array<mmsghdr, count>& messages() noexcept { return messages_; }

 private:
  std::vector<std::byte> bytes_;
  std::size_t each_;
  std::array<iovec, count> parts_{};
  std::array<mmsghdr, count> messages_{};
};

class Sender {
 public:
  Sender(const Socket& socket, const sockaddr_in& to, std::size_t bytes)
      : socket_{socket}, to_{to}, bytes_{bytes} {}

  void send_each(std::int64_t end) {
    Batch<batch> datagrams{bytes_};
    for (mmsghdr& one : datagrams.messages()) {
      one.msg_hdr.msg_name = &to_;
      one.msg_hdr.msg_namelen = sizeof to_;
    }
    while (now_ns() < end) {
      for (std::size_t i = 0; i < batch; ++i) {
        number(datagrams.at(i));
      }
      for (std::size_t done = 0; done < batch;) {
        done += static_cast<std::size_t>(
            check(sendmmsg(socket_.fd(), &datagrams.messages()[done], static_cast<unsigned>(batch - done), 0),
                  "sendmmsg"));
      }
    }
  }

  void send_one_by_one(std::int64_t end) {
    std::vector<std::byte> datagram(bytes_);
    const auto* to = reinterpret_cast<const sockaddr*>(&to_);
    while (now_ns() < end) {
      for (std::size_t i = 0; i < batch; ++i) {
        number(datagram.data());
        check(sendto(socket_.fd(), datagram.data(), datagram.size(), 0, to, sizeof to_), "sendto");
      }
    }
  }

  void send_trains(std::int64_t end) {
    const std::size_t train = std::min(most_in_train, most_bytes_in_train / bytes_);
    std::vector<std::byte> datagrams(train * bytes_);
    iovec part{datagrams.data(), datagrams.size()};
    while (now_ns() < end) {
      for (std::size_t i = 0; i < train; ++i) {
        number(datagrams.data() + i * bytes_);
      }
      send_train(socket_, to_, {&part, 1}, bytes_);
    }
  }

 private:
  void number(std::byte* datagram) {
    ++sent_;
    std::memcpy(datagram, &sent_, sizeof sent_);
  }

  const Socket& socket_;
  sockaddr_in to_;
  std::size_t bytes_;
  std::uint64_t sent_ = 0;
};

class Receiver {
 public:
  Receiver(const Socket& socket, const Options& options) : socket_{socket}, options_{options} {
    figures_.bytes = options.bytes;
  }

  void run() {
    const Request request{options_.seconds + static_cast<double>(warm_up_ns) / 1e9, options_.segmentation,
                          options_.batches};
    ask(socket_, &request, sizeof request);
    start_ = now_ns() + warm_up_ns;
    if (options_.segmentation) {
      receive_trains();
    } else {
      receive_each();
    }
    figures_.seconds = options_.seconds;
    const std::uint64_t sent = last_ - first_ + (first_ != 0 ? 1 : 0);
    figures_.lost = sent - std::min(sent, figures_.received);
    figures_.print();
  }

 private:
  [[nodiscard]] std::int64_t end_ns() const {
    return start_ + static_cast<std::int64_t>(options_.seconds * 1e9);
  }

  void receive_each() {
    Batch<batch> datagrams{options_.bytes};
    for (std::int64_t now = now_ns(); now < end_ns(); now = now_ns()) {
      const int count = recvmmsg(socket_.fd(), datagrams.messages().data(), batch, MSG_WAITFORONE, nullptr);
      for (int i = 0; i < count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        on_datagrams(now, datagrams.at(k), datagrams.messages()[k].msg_len);
      }
    }
  }

  /// Trains come one behind the other in each buffer; all datagrams are of one size, which need not be told.
  void receive_trains() {
    Batch<trains_at_once> trains{train_room};
    for (std::int64_t now = now_ns(); now < end_ns(); now = now_ns()) {
      const int count =
          recvmmsg(socket_.fd(), trains.messages().data(), trains_at_once, MSG_WAITFORONE, nullptr);
      for (int i = 0; i < count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        on_datagrams(now, trains.at(k), trains.messages()[k].msg_len);
      }
    }
  }

  void on_datagrams(std::int64_t now, const std::byte* bytes, std::size_t size) {
    for (; size >= options_.bytes; size -= options_.bytes, bytes += options_.bytes) {
      if (now >= start_) {
        std::memcpy(&last_, bytes, sizeof last_);
        first_ = first_ == 0 ? last_ : first_;
        ++figures_.received;
      }
    }
  }

  const Socket& socket_;
  const Options& options_;
  std::int64_t start_ = 0;
  std::uint64_t first_ = 0;
  std::uint64_t last_ = 0;
  Figures figures_;
};

}  // namespace

/// Whoever asks gets datagrams for so long.
void serve_flood(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  socket.large_buffers();
  socket.bind(options.at);
  for (;;) {
    Request request;
    sockaddr_in from{};
    socklen_t size = sizeof from;
    if (check(recvfrom(socket.fd(), &request, sizeof request, 0, reinterpret_cast<sockaddr*>(&from), &size),
              "recvfrom") != static_cast<std::int64_t>(sizeof request)) {
      continue;
    }
    const std::int64_t end = now_ns() + static_cast<std::int64_t>(request.seconds * 1e9);
    Sender sender{socket, from, options.bytes};
    if (request.segmentation) {
      sender.send_trains(end);
    } else if (request.batches) {
      sender.send_each(end);
    } else {
      sender.send_one_by_one(end);
    }
  }
}

void receive_flood(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  socket.large_buffers();
  socket.receive_timeout(100);
  if (options.segmentation) {
    socket.option(SOL_UDP, UDP_GRO, 1);
  }
  socket.connect(options.at);
  Receiver{socket, options}.run();
}

}  // namespace trestle::floor
