#include "sd/net/e2e_channel.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "sd/net/discovery_text.hpp"
#include "someip/core/e2e/layout.hpp"
#include "someip/wire/slices.hpp"

namespace trestle::sd {

namespace e2e = someip::e2e;
using someip::Header;

namespace {

[[noreturn]] void refuse(const E2eSpec& spec, const std::string& why) {
  throw std::invalid_argument{"e2e of " + hexadecimal(value(spec.id)) + ": " + why};
}

std::string in_words(const e2e::ConfigError& error) {
  return std::string{error.field} + " must be: " + std::string{error.must};
}

/// The part of the SOME/IP header that is protected: from the Request ID on.  [feat_req_someip_102]
class Front {
 public:
  Front(const Header& header, bool none) : size_{none ? 0 : someip::length_covered_header_bytes} {
    static_cast<void>(someip::encode_header(header, 0, bytes_));  // there is room
  }
  [[nodiscard]] ByteView view() const noexcept {
    return ByteView{bytes_}.last(someip::length_covered_header_bytes).first(size_);
  }

 private:
  std::array<std::byte, someip::header_bytes> bytes_{};
  std::size_t size_;
};

}  // namespace

E2eChannel::Place E2eChannel::place_of(const e2e::Config& config, const E2eSpec& spec, const char* which) {
  const auto layout = e2e::make_layout(config);
  if (!layout) {
    refuse(spec, std::string{which} + "." + in_words(layout.error()));
  }
  const std::size_t front = spec.payload_only ? 0 : someip::length_covered_header_bytes;
  if (layout->header_at() < front) {
    refuse(spec, std::string{which} + ".offset_bits must be: at least 64, behind the SOME/IP header");
  }
  const auto bytes = layout->header_bytes();
  if (!bytes) {
    refuse(spec, std::string{which} + ".crc_offset_bits, counter_offset_bits and data_id_nibble_offset_bits" +
                     " must be: neighbours");
  }
  return {layout->header_at() - front, *bytes};
}

E2eChannel::E2eChannel(const E2eSpec& spec) : spec_{spec} {
  if (!spec.protect && !spec.check) {
    refuse(spec, "there is neither protect nor check");
  }
  if (spec.source_id > 0x0fffffff) {
    refuse(spec, "source_id must be: of 28 bits");
  }
  if (spec.max_peers == 0) {
    refuse(spec, "max_peers must be: at least 1");
  }
  if (spec.protect) {
    const Place place = place_of(*spec.protect, spec, "protect");
    sending_.emplace(Sending{place, {*e2e::Protector::create(*spec.protect), spec.max_peers}});
  }
  if (spec.check) {
    const Place place = place_of(*spec.check, spec, "check");
    const auto checker = e2e::Checker::create(*spec.check, spec.state_machine);
    if (!checker) {  // the profile is all right
      refuse(spec, "state_machine." + in_words(checker.error()));
    }
    receiving_.emplace(Receiving{place, {*checker, spec.max_peers}});
  }
}

// --- Sending ----------------------------------------------------------------------------------------------

E2eChannel::Bytes E2eChannel::protect(e2e::Protector& protector, const Header& header,
                                      std::span<const ByteView> payload,
                                      const e2e::MethodInfo& method) const {
  const std::size_t given = size_of(payload);
  const Place& place = sending_->place;
  if (given < place.at) {
    return nullptr;
  }
  const auto bytes = std::make_shared<std::vector<std::byte>>();
  bytes->reserve(given + place.bytes);
  // The payload goes behind the room for the E2E header; what belongs before that is then moved there.
  bytes->resize(place.bytes);
  for (const ByteView slice : payload) {
    bytes->insert(bytes->end(), slice.begin(), slice.end());
  }
  const auto begin = bytes->begin();
  const auto moved = static_cast<std::ptrdiff_t>(place.at);
  const auto room = static_cast<std::ptrdiff_t>(place.bytes);
  std::copy(begin + room, begin + room + moved, begin);
  std::fill(begin + moved, begin + moved + room, std::byte{0});
  if (!protector.protect(Front{header, spec_.payload_only}.view(), *bytes, method)) {
    return nullptr;
  }
  return bytes;
}

E2eChannel::Bytes E2eChannel::protect(const E2ePeer& to, const Header& header,
                                      std::span<const ByteView> payload, const e2e::MethodInfo& method) {
  e2e::Protector& protector = sending_->peers[to];
  const std::uint32_t counter = protector.next_counter();
  Bytes bytes = protect(protector, header, payload, method);
  if (bytes) {
    last_ = counter;
  }
  return bytes;
}

void E2eChannel::take_back(const E2ePeer& to) {
  sending_->peers[to].resume(*last_);
}

E2eChannel::Bytes E2eChannel::protect_as(std::uint32_t counter, const Header& header,
                                         std::span<const ByteView> payload, const e2e::MethodInfo& method) {
  e2e::Protector protector = sending_->peers.fresh();
  protector.resume(counter);
  return protect(protector, header, payload, method);
}

E2eChannel::Bytes E2eChannel::protect_again(const Header& header, ByteView payload) {
  return last_ ? protect_as(*last_, header, {&payload, 1}, {}) : protect({}, header, {&payload, 1});
}

// --- Receiving --------------------------------------------------------------------------------------------

e2e::CheckResult E2eChannel::check(const E2ePeer& from, someip::Message& message,
                                   const e2e::MethodExpectation& expected, bool known,
                                   std::vector<std::byte>& room) {
  const Front front{message.header, spec_.payload_only};
  e2e::CheckResult result;
  if (e2e::Checker* const checker = receiving_->peers.find(from)) {
    result = checker->check(front.view(), message.payload, expected);
  } else {
    e2e::Checker first = receiving_->peers.fresh();
    result = first.check(front.view(), message.payload, expected);
    // Otherwise anybody could make us forget the other peers.
    if (known || result.fault == e2e::Fault::none) {
      receiving_->peers.add(from, first);
    }
  }
  const auto& [at, bytes] = receiving_->place;
  const ByteView all = message.payload;
  if (all.size() < at + bytes) {
    message.payload = {};
  } else if (at == 0) {
    message.payload = all.subspan(bytes);
  } else {
    const ByteView behind = all.subspan(at + bytes);
    room.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(at));
    room.insert(room.end(), behind.begin(), behind.end());
    message.payload = room;
  }
  return result;
}

bool E2eChannel::passes(const e2e::CheckResult& result) const noexcept {
  return spec_.pass_failed || result.status == e2e::CheckStatus::ok ||
         result.status == e2e::CheckStatus::ok_some_lost;
}

void E2eChannel::forget(const Endpoint& peer) {
  if (sending_) {
    sending_->peers.forget(peer);
  }
  if (receiving_) {
    receiving_->peers.forget(peer);
  }
}

void E2eChannels::forget(const std::optional<Endpoint>& udp, const std::optional<Endpoint>& tcp) const {
  for (const auto& channel : channels_) {
    for (const auto& peer : {udp, tcp}) {
      if (peer) {
        channel->forget(*peer);
      }
    }
  }
}

}  // namespace trestle::sd
