#include "bridge/carry/record/someip_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

/// Channels of a recording: each call comes from a port of its own, perhaps.
constexpr std::size_t max_channels = 20'000;

}  // namespace

SomeipRecorder::SomeipRecorder(record::Recorder& recorder, const describe::Interfaces* interfaces,
                               std::uint16_t sd_port)
    : recorder_{recorder},
      interfaces_{interfaces},
      messages_{sd_port, [this](const traffic::Place& place, const someip::Message& message) {
                  record(place, message);
                }} {}

void SomeipRecorder::on_frame(const pcaps::Frame& frame) {
  const std::uint64_t before = messages_.found();
  messages_.on_frame(frame);
  if (recorder_.keeps_frames() && carries_someip(frame, before)) {
    recorder_.add(frame);
  }
}

/// What SOME/IP is made of is kept; of a fragment and of TCP a frame alone does not say whether it is that.
bool SomeipRecorder::carries_someip(const pcaps::Frame& frame, std::uint64_t found_before) const {
  if (messages_.found() != found_before) {
    return true;
  }
  const auto packet = pcaps::find_ip(frame);
  if (!packet || !*packet) {
    return false;
  }
  if ((*packet)->fragment) {
    return true;
  }
  const auto segment =
      (*packet)->protocol == 6 ? pcaps::parse_tcp(**packet) : pcaps::FrameResult<pcaps::TcpSegment>{};
  return (*packet)->protocol == 6 && segment &&
         (is_tcp_server({(*packet)->from, segment->from_port}) ||
          is_tcp_server({(*packet)->to, segment->to_port}));
}

/// Whether discovery has told of a service there.
bool SomeipRecorder::is_tcp_server(const Endpoint& at) const {
  return std::ranges::any_of(messages_.network().services(),
                             [&](const auto& one) { return one.second.tcp == at; });
}

SomeipRecordCounters SomeipRecorder::counters() const {
  return {.messages = recorded_, .malformed = messages_.malformed(), .incomplete = messages_.incomplete()};
}

void SomeipRecorder::record(const traffic::Place& place, const someip::Message& message) {
  const someip::Header& header = message.header;
  const Key key{place.transport.value_or(Transport::udp), place.flow.from, place.flow.to, header.service,
                header.method};
  const auto number = channel(key, header);
  if (!number) {
    recorder_.drop_without_channel();
    return;
  }
  std::vector<std::byte> bytes(message.size());
  if (!someip::encode(header, message.payload, bytes)) {
    return;  // it was decoded: its length is one that the field can say
  }
  ++recorded_;
  const auto time = static_cast<record::LogTime>(place.time.time_since_epoch().count());
  recorder_.add(*number, time, time, value(header.session), std::move(bytes));
}

std::optional<std::uint16_t> SomeipRecorder::channel(const Key& key, const someip::Header& header) {
  if (const auto known = channels_.find(key); known != channels_.end()) {
    return known->second;
  }
  if (channels_.size() == max_channels) {
    return std::nullopt;
  }
  return channels_.emplace(key, recorder_.add_channel(info_of(key, header))).first->second;
}

record::ChannelInfo SomeipRecorder::info_of(const Key& key, const someip::Header& header) const {
  const auto& [transport, from, to, service, method] = key;
  record::ChannelInfo info{.topic = topic_of(header), .type = "someip", .encoding = "someip"};
  info.metadata = {{"transport", transport == Transport::udp ? "udp" : "tcp"},
                   {"from", someip::to_string(from)},
                   {"to", someip::to_string(to)},
                   {"service", fmt::format("0x{:04x}", value(service))},
                   {"method", fmt::format("0x{:04x}", value(method))}};
  const bool is_sent_by_server =
      header.type != someip::MessageType::request && header.type != someip::MessageType::request_no_return;
  const Endpoint& server = is_sent_by_server ? from : to;
  for (const auto& [at, seen] : messages_.network().services()) {
    if (seen.service == service && (transport == Transport::udp ? seen.udp : seen.tcp) == server) {
      info.metadata["instance"] = fmt::format("0x{:04x}", value(seen.instance));
      info.metadata["major"] = std::to_string(seen.major);
      info.metadata["minor"] = std::to_string(seen.minor);
      break;
    }
  }
  return info;
}

std::string SomeipRecorder::topic_of(const someip::Header& header) const {
  if (sd::is_sd(header)) {
    return "/someip/sd";
  }
  const auto* const service =
      interfaces_ == nullptr ? nullptr : interfaces_->service(header.service, header.interface_version);
  std::string name;
  if (service != nullptr) {
    const auto* const element = interfaces_->element(header.service, header.interface_version, header.method);
    name = element != nullptr
               ? element->name
               : fmt::format("{}/0x{:04x}", interfaces_->name_of(header.service, header.interface_version),
                             value(header.method));
  } else {
    name = fmt::format("0x{:04x}/0x{:04x}", value(header.service), value(header.method));
  }
  std::ranges::replace(name, '.', '/');
  return "/someip/" + name;
}

}  // namespace trestle::carry
