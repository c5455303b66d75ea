#include "someip/net/udp_transmitter.hpp"

#include <netinet/udp.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>

#include "someip/net/socket_calls.hpp"

namespace trestle::someip {
namespace {

// Tells the kernel the size of the datagrams into which it cuts a message.
struct SegmentSize {
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint16_t))> control;

  void ask(msghdr& message, std::size_t datagram_bytes) noexcept {
    control.fill(std::byte{0});
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* const header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_UDP;
    header->cmsg_type = UDP_SEGMENT;
    header->cmsg_len = CMSG_LEN(sizeof(std::uint16_t));
    const auto segment = static_cast<std::uint16_t>(datagram_bytes);
    std::memcpy(CMSG_DATA(header), &segment, sizeof segment);
  }
};

/// Whether the kernel or the device may lack this offload, or a filter of system calls may forbid it. Any
/// other fault shows again when the datagrams are sent one by one.
bool says_no_offload(int error) noexcept {
  return error == EIO || error == EINVAL || error == EMSGSIZE || error == EOPNOTSUPP ||
         error == ENOPROTOOPT || error == EPERM;
}

}  // namespace

UdpTransmitter::UdpTransmitter(int fd, unsigned scope)
    : fd_{fd}, scope_{scope}, messages_(max_datagrams), parts_(max_slices) {
  addresses_.reserve(max_datagrams);
}

SendStatus UdpTransmitter::send(const Endpoint& to, std::span<const ByteView> slices) {
  assert(slices.size() <= max_slices);
  std::transform(slices.begin(), slices.end(), parts_.begin(), to_iovec);
  SocketAddress address{to, scope_};
  msghdr& header = message(0, address, parts_.data(), slices.size()).msg_hdr;
  if (source_bytes_ != 0) {
    header.msg_control = source_.data();
    header.msg_controllen = source_bytes_;
  }
  return transmit_all(1).status;
}

void UdpTransmitter::send_from(const IpAddress& source) noexcept {
  const auto put = [this](int level, int type, const auto& info) {
    static_assert(CMSG_SPACE(sizeof info) <= sizeof source_);
    msghdr message{};
    message.msg_control = source_.data();
    message.msg_controllen = source_bytes_ = CMSG_SPACE(sizeof info);
    cmsghdr* const header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = level;
    header->cmsg_type = type;
    header->cmsg_len = CMSG_LEN(sizeof info);
    std::memcpy(CMSG_DATA(header), &info, sizeof info);
  };
  if (source.v6) {
    in6_pktinfo info{};
    std::memcpy(&info.ipi6_addr, source.bytes.data(), sizeof info.ipi6_addr);
    put(IPPROTO_IPV6, IPV6_PKTINFO, info);
  } else {
    in_pktinfo info{};
    std::memcpy(&info.ipi_spec_dst, source.bytes.data(), sizeof info.ipi_spec_dst);
    put(IPPROTO_IP, IP_PKTINFO, info);
  }
}

UdpTransmitter::Batch UdpTransmitter::send_segments(const Endpoint& to, std::span<const ByteView> slices,
                                                    std::span<const std::uint8_t> slice_counts,
                                                    std::size_t datagram_bytes) {
  assert(slice_counts.size() <= max_datagrams && slices.size() <= max_slices);
  std::transform(slices.begin(), slices.end(), parts_.begin(), to_iovec);
  SocketAddress address{to, scope_};
  if (slice_counts.size() > 1 && offload_for(to.address)) {
    SegmentSize size;
    size.ask(message(0, address, parts_.data(), slices.size()).msg_hdr, datagram_bytes);
    const Batch batch = transmit_all(1);
    if (batch.status == SendStatus::sent) {
      return {slice_counts.size(), SendStatus::sent};
    }
    if (batch.status == SendStatus::would_block || !says_no_offload(errno)) {
      return batch;
    }
    note_refusal(to.address);
  }
  iovec* next = parts_.data();
  for (std::size_t i = 0; i < slice_counts.size(); ++i) {
    message(i, address, next, slice_counts[i]);
    next += slice_counts[i];
  }
  return transmit_all(slice_counts.size());
}

UdpTransmitter::Batch UdpTransmitter::send_trains(std::span<const Train> trains) {
  Batch sum;
  while (!trains.empty()) {
    // Each train is one message for the system if it can cut the train, otherwise each datagram is one.
    std::array<SegmentSize, max_datagrams> sizes;
    std::array<std::uint8_t, max_datagrams> datagrams;
    std::array<std::uint8_t, max_datagrams> train_of;
    std::size_t count = 0;
    addresses_.clear();
    for (std::size_t i = 0; i < trains.size(); ++i) {
      const Train& train = trains[i];
      if (i == 0 || trains[i - 1].peer != train.peer) {
        addresses_.emplace_back(train.peer, scope_);
      }
      const bool whole = train.size() > 1 && offload_for(train.peer.address);
      for (std::size_t k = 0; k < (whole ? 1 : train.size()); ++k) {
        assert(count < max_datagrams);
        parts_[count] = to_iovec(whole ? train.bytes : train[k]);
        msghdr& header = message(count, addresses_.back(), &parts_[count], 1).msg_hdr;
        if (whole) {
          sizes[count].ask(header, train.datagram_bytes);
        }
        datagrams[count] = static_cast<std::uint8_t>(whole ? train.size() : 1);
        train_of[count++] = static_cast<std::uint8_t>(i);
      }
    }
    const Batch batch = transmit_all(count);
    sum.status = batch.status;
    for (std::size_t i = 0; i < batch.sent; ++i) {
      sum.sent += datagrams[i];
    }
    if (batch.status != SendStatus::failed || datagrams[batch.sent] == 1 || !says_no_offload(errno)) {
      return sum;
    }
    trains = trains.subspan(train_of[batch.sent]);
    note_refusal(trains.front().peer.address);  // so that it is sent as single datagrams now
  }
  return sum;
}

mmsghdr& UdpTransmitter::message(std::size_t index, SocketAddress& to, iovec* parts, std::size_t part_count) {
  mmsghdr& result = messages_[index];
  result = {};
  result.msg_hdr.msg_name = to.data();
  result.msg_hdr.msg_namelen = to.size();
  result.msg_hdr.msg_iov = parts;
  result.msg_hdr.msg_iovlen = part_count;
  return result;
}

// Sends the first `count` of messages_. The batch counts these.
UdpTransmitter::Batch UdpTransmitter::transmit_all(std::size_t count) {
  Batch batch;
  while (batch.sent < count) {
    const int sent = transmit(&messages_[batch.sent], count - batch.sent);
    if (sent < 0) {
      interface_full_ = errno == ENOBUFS;
      batch.status = retry_later(errno) ? SendStatus::would_block : SendStatus::failed;
      return batch;
    }
    batch.sent += static_cast<std::size_t>(sent);
    told_error_ |= told_errors_ && batch.sent < count;  // sendmmsg() does not say what stopped it
  }
  return batch;
}

// How many the system took, or -1: none, and errno says why.
int UdpTransmitter::transmit(mmsghdr* messages, std::size_t count) {
  for (int tries_left = told_errors_ ? max_told_errors : 0;; --tries_left) {
    const int sent = try_transmit(messages, count);
    if (sent >= 0 || retry_later(errno) || tries_left == 0) {
      return sent;
    }
    told_error_ = true;
  }
}

int UdpTransmitter::try_transmit(mmsghdr* messages, std::size_t count) {
  if (count > 1 && has_sendmmsg_) {
    ++counters_.calls;
    const int sent = sendmmsg(fd_, messages, static_cast<unsigned>(count), 0);
    if (sent >= 0 || errno != ENOSYS) {
      return sent;
    }
    has_sendmmsg_ = false;
  }
  ++counters_.calls;
  return sendmsg(fd_, &messages->msg_hdr, 0) < 0 ? -1 : 1;
}

bool UdpTransmitter::offload_for(const IpAddress& receiver) {
  const auto known = std::ranges::find(refusals_, receiver, &Refusal::receiver);
  if (known == refusals_.end()) {
    return true;
  }
  if (known->trains_left > 0) {
    --known->trains_left;
    return false;
  }
  return true;  // the offload works again, or the refusal is noted anew
}

void UdpTransmitter::note_refusal(const IpAddress& receiver) {
  ++counters_.offload_refused;
  const auto known = std::ranges::find(refusals_, receiver, &Refusal::receiver);
  if (known != refusals_.end()) {
    known->trains_left = offload_pause;
  } else if (refusals_.size() < max_refusals) {
    refusals_.push_back({receiver, offload_pause});
  } else {
    refusals_[next_refusal_] = {receiver, offload_pause};
    next_refusal_ = (next_refusal_ + 1) % max_refusals;
  }
}

}  // namespace trestle::someip
