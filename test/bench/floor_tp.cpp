// Large messages in SOME/IP-TP segments and nothing else of SOME/IP: headers and slices of the payload
// gathered by the kernel, 45 segments a call, and copied to their places at the other side.
#include <netinet/udp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "test/bench/floor.hpp"

namespace trestle::floor {
namespace {

constexpr std::size_t header_bytes = 20;
constexpr std::size_t slice_bytes = 1392;
constexpr std::size_t datagram_bytes = header_bytes + slice_bytes;
constexpr std::size_t burst = 45;
constexpr std::size_t front_bytes = 16;  ///< sequence number, and when the message was sent
constexpr int patience_ms = 100;

/// What a receiver asks for.
struct Request {
  std::uint64_t bytes = 0;
  std::uint64_t window = 0;
  std::int64_t duration_ns = 0;
  bool segmentation = true;
};

using Header = std::array<std::byte, header_bytes>;

/// The fields that the receiver needs where SOME/IP-TP has them: session, and offset with the more flag.
void fill(Header& header, std::uint64_t sequence, std::size_t offset, bool more) {
  const auto put = [&](std::size_t at, std::uint64_t number, unsigned bytes) {
    for (unsigned i = 0; i < bytes; ++i) {
      header[at + i] = static_cast<std::byte>(number >> (8 * (bytes - 1 - i)));
    }
  };
  header = {};
  put(10, sequence & 0xffffU, 2);
  put(16, offset | (more ? 1U : 0U), 4);
}

std::uint64_t number(const std::byte* at, unsigned bytes) {
  std::uint64_t result = 0;
  for (unsigned i = 0; i < bytes; ++i) {
    result = result << 8U | std::to_integer<std::uint64_t>(at[i]);
  }
  return result;
}

class Sender {
 public:
  Sender(const Socket& socket, const sockaddr_in& to, const Request& request)
      : socket_{socket}, to_{to}, request_{request}, payload_(request.bytes, std::byte{0x5a}) {}

  void run() {
    const std::int64_t end = now_ns() + request_.duration_ns;
    while (now_ns() < end) {
      while (request_.window > 0 && sent_ - acknowledged_ >= request_.window) {
        take_acknowledgement(0);
      }
      while (request_.window > 0 && sent_ > acknowledged_ && take_acknowledgement(MSG_DONTWAIT)) {
      }
      ++sent_;
      const std::int64_t now = now_ns();
      std::memcpy(payload_.data(), &sent_, sizeof sent_);
      std::memcpy(payload_.data() + sizeof sent_, &now, sizeof now);
      send_message();
    }
  }

 private:
  bool take_acknowledgement(int flags) {
    std::uint64_t sequence = 0;
    const auto got = recv(socket_.fd(), &sequence, sizeof sequence, flags);
    if (got == static_cast<std::int64_t>(sizeof sequence)) {
      acknowledged_ = std::clamp(sequence, acknowledged_, sent_);
    } else if (flags == 0) {
      acknowledged_ = sent_;  // lost
    }
    return got > 0;
  }

  void send_message() {
    for (std::size_t offset = 0; offset < payload_.size();) {
      std::size_t count = 0;
      for (; count < burst && offset < payload_.size(); ++count) {
        const std::size_t bytes = std::min(slice_bytes, payload_.size() - offset);
        fill(headers_[count], sent_, offset, offset + bytes < payload_.size());
        parts_[2 * count] = {headers_[count].data(), header_bytes};
        parts_[2 * count + 1] = {payload_.data() + offset, bytes};
        offset += bytes;
      }
      if (request_.segmentation) {
        send_train(socket_, to_, std::span{parts_}.first(2 * count), datagram_bytes);
      } else {
        send_each(count);
      }
    }
  }

  void send_each(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      messages_[i].msg_hdr = {};
      messages_[i].msg_hdr.msg_name = &to_;
      messages_[i].msg_hdr.msg_namelen = sizeof to_;
      messages_[i].msg_hdr.msg_iov = &parts_[2 * i];
      messages_[i].msg_hdr.msg_iovlen = 2;
    }
    for (std::size_t done = 0; done < count;) {
      done += static_cast<std::size_t>(check(
          sendmmsg(socket_.fd(), &messages_[done], static_cast<unsigned>(count - done), 0), "sendmmsg"));
    }
  }

  const Socket& socket_;
  sockaddr_in to_;
  Request request_;
  std::vector<std::byte> payload_;
  std::array<Header, burst> headers_{};
  std::array<iovec, 2 * burst> parts_{};
  std::array<mmsghdr, burst> messages_{};
  std::uint64_t sent_ = 0;
  std::uint64_t acknowledged_ = 0;
};

class Receiver {
 public:
  Receiver(const Socket& socket, const Options& options)
      : socket_{socket}, options_{options}, message_(options.bytes) {
    figures_.bytes = options.bytes;
  }

  void run() {
    const Request request{options_.bytes, options_.window,
                          static_cast<std::int64_t>(options_.seconds * 1e9) + warm_up_ns,
                          options_.segmentation};
    ask(socket_, &request, sizeof request);
    start_ = now_ns() + warm_up_ns;
    const std::int64_t end = start_ + static_cast<std::int64_t>(options_.seconds * 1e9);
    while (now_ns() < end) {
      if (options_.segmentation) {
        receive_together();
      } else {
        receive_each();
      }
    }
    figures_.seconds = options_.seconds;
    const std::uint64_t sent = last_ - first_ + (first_ != 0 ? 1 : 0);
    figures_.lost = sent - std::min(sent, figures_.received);
    figures_.print();
  }

 private:
  void receive_together() {
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control;
    iovec part{room_.data(), room_.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const auto got = recvmsg(socket_.fd(), &message, 0);
    if (got <= 0) {
      return;
    }
    auto segment = static_cast<std::size_t>(got);
    for (cmsghdr* one = CMSG_FIRSTHDR(&message); one != nullptr; one = CMSG_NXTHDR(&message, one)) {
      if (one->cmsg_level == SOL_UDP && one->cmsg_type == UDP_GRO) {
        int size = 0;
        std::memcpy(&size, CMSG_DATA(one), sizeof size);
        segment = static_cast<std::size_t>(size);
      }
    }
    for (std::size_t at = 0; at < static_cast<std::size_t>(got); at += segment) {
      on_datagram(room_.data() + at, std::min(segment, static_cast<std::size_t>(got) - at));
    }
  }

  void receive_each() {
    for (std::size_t i = 0; i < burst; ++i) {
      parts_[i] = {room_.data() + i * datagram_bytes, datagram_bytes};
      messages_[i].msg_hdr = {};
      messages_[i].msg_hdr.msg_iov = &parts_[i];
      messages_[i].msg_hdr.msg_iovlen = 1;
    }
    const int count = recvmmsg(socket_.fd(), messages_.data(), burst, MSG_WAITFORONE, nullptr);
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      on_datagram(room_.data() + k * datagram_bytes, messages_[k].msg_len);
    }
  }

  void on_datagram(const std::byte* datagram, std::size_t size) {
    if (size <= header_bytes) {
      return;
    }
    const std::uint64_t session = number(datagram + 10, 2);
    const std::size_t offset = number(datagram + 16, 4) & ~std::uint64_t{0xf};
    const std::size_t bytes = size - header_bytes;
    if (session != session_) {
      session_ = session;
      gathered_ = 0;
    }
    if (offset + bytes > message_.size()) {
      return;
    }
    std::memcpy(message_.data() + offset, datagram + header_bytes, bytes);
    gathered_ += bytes;
    if (gathered_ == message_.size()) {
      on_message();
    }
  }

  void on_message() {
    const std::int64_t now = now_ns();
    std::uint64_t sequence = 0;
    std::int64_t sent = 0;
    std::memcpy(&sequence, message_.data(), sizeof sequence);
    std::memcpy(&sent, message_.data() + sizeof sequence, sizeof sent);
    if (options_.window > 0 && ++since_acknowledged_ >= std::max<std::size_t>(options_.window / 4, 1)) {
      since_acknowledged_ = 0;
      check(send(socket_.fd(), &sequence, sizeof sequence, 0), "send");
    }
    if (now >= start_) {
      first_ = first_ == 0 ? sequence : first_;
      last_ = sequence;
      ++figures_.received;
      figures_.latency.add(now - sent);
    }
  }

  const Socket& socket_;
  const Options& options_;
  std::vector<std::byte> message_;
  std::array<std::byte, 65536> room_;
  std::array<iovec, burst> parts_{};
  std::array<mmsghdr, burst> messages_{};
  std::uint64_t session_ = 0;
  std::size_t gathered_ = 0;
  std::size_t since_acknowledged_ = 0;
  std::int64_t start_ = 0;
  std::uint64_t first_ = 0;
  std::uint64_t last_ = 0;
  Figures figures_;
};

}  // namespace

void serve_tp(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  socket.large_buffers();
  socket.bind(options.at);
  socket.receive_timeout(patience_ms);
  for (;;) {
    Request request;
    sockaddr_in from{};
    socklen_t size = sizeof from;
    if (recvfrom(socket.fd(), &request, sizeof request, 0, reinterpret_cast<sockaddr*>(&from), &size) ==
            static_cast<std::int64_t>(sizeof request) &&
        request.bytes >= front_bytes) {
      Sender{socket, from, request}.run();
    }
  }
}

void receive_tp(const Options& options) {
  const Socket socket{SOCK_DGRAM};
  socket.large_buffers();
  socket.receive_timeout(patience_ms);
  if (options.segmentation) {
    socket.option(SOL_UDP, UDP_GRO, 1);
  }
  socket.connect(options.at);
  const auto receiver = std::make_unique<Receiver>(socket, options);
  receiver->run();
}

}  // namespace trestle::floor
