#include "bridge/conform/fuzz/player.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <tuple>

#include "pcaps/capture_file.hpp"
#include "pcaps/network.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;

constexpr Duration connect_within = 300ms;
constexpr std::size_t session_at = 10;
constexpr std::size_t flags_at = 16;

}  // namespace

Player::Player(const Profile& profile, Tester& tester, SdSessions& sessions)
    : profile_{profile}, tester_{tester}, sessions_{sessions}, udp_{tester.open_udp_at(own_port)} {}

void Player::play(const Sequence& sequence) {
  for (const Step& step : sequence.steps) {
    switch (step.way) {
      case Way::sd_unicast:
        send_sd(step, {profile_.device, profile_.sd_port});
        break;
      case Way::sd_multicast:
        send_sd(step, tester_.sd_group());
        break;
      case Way::udp:
        tester_.send(udp_, step.bytes, {profile_.device, step.port});
        break;
      case Way::tcp:
        send_tcp(step);
        break;
      case Way::tcp_close:
        if (const auto connection = connections_.extract(step.port)) {
          tester_.note_end(connection.mapped());
          tester_.close(connection.mapped());
        }
        break;
    }
    tester_.receive(step.pause, [] { return false; });
  }
}

void Player::send_sd(const Step& step, const Endpoint& to) {
  fuzz::Bytes bytes = step.bytes;
  if (step.counted && bytes.size() > flags_at) {
    const SdSessions::Next next = sessions_.next(to);
    someip::store<std::uint16_t>(bytes.data() + session_at, value(next.session));
    bytes[flags_at] = (bytes[flags_at] & std::byte{0x7f}) | (next.reboot ? std::byte{0x80} : std::byte{});
  }
  tester_.send_sd(bytes, to);
}

void Player::send_tcp(const Step& step) {
  const auto known = connections_.find(step.port);
  if (known != connections_.end() && tester_.is_closed(known->second)) {
    tester_.close(known->second);
    connections_.erase(known);
  }
  if (!connections_.contains(step.port)) {
    if (const auto opened = tester_.connect({profile_.device, step.port}, connect_within)) {
      connections_.emplace(step.port, *opened);
    }
  }
  // A device that refuses connections for now is no reason to stop.
  if (const auto connection = connections_.find(step.port); connection != connections_.end()) {
    tester_.send(connection->second, step.bytes);
  }
}

void Player::close_connections() {
  for (const auto& [port, connection] : connections_) {
    tester_.close(connection);
  }
  connections_.clear();
}

namespace {

/// What one frame of a capture does, or nothing: it is not of the tester.
std::optional<Step> step_of(const pcaps::IpPacket& packet, const Profile& profile) {
  if (packet.from != profile.tester || (packet.to != profile.device && packet.to != profile.multicast)) {
    return std::nullopt;
  }
  constexpr std::uint8_t tcp = 6;
  constexpr std::uint8_t udp = 17;
  Step step;
  ByteView bytes;
  if (packet.protocol == udp) {
    const auto datagram = pcaps::parse_udp(packet);
    if (!datagram) {
      return std::nullopt;
    }
    bytes = datagram->payload;
    step.port = datagram->to_port;
    if (packet.to == profile.multicast) {
      step.way = Way::sd_multicast;
    } else if (datagram->to_port == profile.sd_port) {
      step.way = Way::sd_unicast;
    }
  } else if (packet.protocol == tcp) {
    const auto segment = pcaps::parse_tcp(packet);
    if (!segment || segment->syn) {
      return std::nullopt;
    }
    bytes = segment->payload;
    step.port = segment->to_port;
    step.way = segment->fin || segment->rst ? Way::tcp_close : Way::tcp;
    if (bytes.empty() && step.way == Way::tcp) {
      return std::nullopt;  // an acknowledgement
    }
  } else {
    return std::nullopt;
  }
  step.bytes.assign(bytes.begin(), bytes.end());
  return step;
}

}  // namespace

Sequence sequence_of_capture(const std::string& path, const Profile& profile) {
  pcaps::CaptureFile file{path};
  Sequence all{.state = "capture"};
  std::optional<pcaps::Timestamp> before;
  while (const auto frame = file.next()) {
    const auto packet = pcaps::find_ip(*frame);
    if (!packet || !*packet) {
      continue;
    }
    if (auto step = step_of(**packet, profile)) {
      if (before) {
        all.steps.back().pause = std::clamp(
            std::chrono::duration_cast<std::chrono::milliseconds>(frame->time - *before), 0ms, 10'000ms);
      }
      before = frame->time;
      all.steps.push_back(std::move(*step));
    }
  }
  if (all.steps.empty()) {
    throw std::runtime_error{path +
                             ": nothing in it goes from the tester's address to the device's; look at " +
                             "both in the profile"};
  }
  return all;
}

}  // namespace trestle::conform
