#pragma once
#include <algorithm>
#include <map>
#include <optional>

#include "fuzz/seeds.hpp"
#include "pcaps/traffic.hpp"
#include "someip/wire/header.hpp"

namespace trestle::fuzz {

/// Makes inputs of sd_machine.cpp from recorded SD messages: datagrams and the time between them. Services,
/// instances, versions, eventgroups and hosts are renamed in the order of their appearance to those that the
/// target's machine knows; else it would pass over nearly all that was recorded.
class SdConversation {
 public:
  explicit SdConversation(const std::filesystem::path& folder) : seeds_{folder, "sd_machine"} {}

  void add(const pcaps::Origin& origin, const someip::Message& message) {
    std::vector<std::byte> payload{message.payload.begin(), message.payload.end()};
    const std::uint8_t host = host_of(origin.from.address);
    rename(payload, origin.from.address, host);
    if (input_.size() + step_bytes + payload.size() > max_seed_bytes) {
      flush();
    }
    wait_until(origin.time);
    input_.put(origin.to.address.is_multicast() ? multicast_datagram : datagram);
    input_.put(static_cast<std::uint8_t>(host - 1));
    input_.put(value(message.header.session));
    input_.put(static_cast<std::uint16_t>(payload.size()));
    input_.put(payload);
  }
  void end_capture() {
    flush();
    known_ = {};
  }
  [[nodiscard]] std::size_t seeds() const { return seeds_.size(); }

 private:
  static constexpr std::uint8_t datagram = 0;
  static constexpr std::uint8_t multicast_datagram = 0x84;
  static constexpr std::uint8_t milliseconds = 4;
  static constexpr std::size_t step_bytes = 9;  // at most: what a wait and a datagram have beside the payload

  /// Numbers in the order of their first appearance.
  class Names {
   public:
    explicit Names(std::uint16_t first) : next_{first} {}
    std::uint16_t of(std::uint16_t recorded) {
      const auto [name, added] = names_.try_emplace(recorded, next_);
      next_ = static_cast<std::uint16_t>(next_ + (added ? 1 : 0));
      return name->second;
    }

   private:
    std::uint16_t next_;
    std::map<std::uint16_t, std::uint16_t> names_;
  };
  /// What the capture at hand has shown.
  struct Known {
    std::vector<IpAddress> hosts;
    Names services{0x1234};
    Names instances{1};
    Names majors{1};
    Names eventgroups{1};
  };

  void flush() {
    if (input_.size() != 0) {
      seeds_.add(input_.bytes());
    }
    input_.clear();
    last_.reset();
  }

  /// The last byte of the address that the machine sees; it itself has 10.0.0.1.
  std::uint8_t host_of(const IpAddress& address) {
    constexpr std::size_t hosts = 7;
    const auto found = std::ranges::find(known_.hosts, address);
    const auto index = static_cast<std::size_t>(found - known_.hosts.begin());
    if (found == known_.hosts.end()) {
      known_.hosts.push_back(address);
    }
    return static_cast<std::uint8_t>(2 + index % hosts);
  }

  void wait_until(pcaps::Timestamp now) {
    const auto waited = last_ && now > *last_ ? now - *last_ : pcaps::Timestamp::duration{};
    last_ = now;
    const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(waited).count();
    if (passed > 0) {
      input_.put(milliseconds);
      input_.put(static_cast<std::uint16_t>(std::min<std::int64_t>(passed, 0xffff)));
    }
  }

  void rename(std::vector<std::byte>& payload, const IpAddress& sender, std::uint8_t host) {
    constexpr std::size_t entries_at = 8;
    constexpr std::size_t entry_bytes = 16;
    if (payload.size() < entries_at) {
      return;
    }
    const std::size_t length = someip::load<std::uint32_t>(payload.data() + 4);
    const std::size_t end = std::min(payload.size(), entries_at + length);
    for (std::size_t at = entries_at; at + entry_bytes <= end; at += entry_bytes) {
      rename_entry(payload.data() + at);
    }
    // Wherever the sender's address stands behind the entries, it is that of an endpoint.
    const auto address = std::as_bytes(std::span{sender.bytes}).first(4);
    const std::array<std::byte, 4> seen{std::byte{10}, std::byte{0}, std::byte{0}, std::byte{host}};
    for (auto rest = payload.begin() + static_cast<std::ptrdiff_t>(end);;) {
      rest = std::search(rest, payload.end(), address.begin(), address.end());
      if (rest == payload.end()) {
        return;
      }
      rest = std::copy(seen.begin(), seen.end(), rest);
    }
  }

  /// Values that mean "any" stay.
  void rename_entry(std::byte* entry) {
    constexpr std::size_t service_at = 4;
    constexpr std::size_t instance_at = 6;
    constexpr std::size_t major_at = 8;
    constexpr std::size_t eventgroup_at = 14;
    rename_field(known_.services, entry + service_at);
    rename_field(known_.instances, entry + instance_at);
    if (entry[major_at] != std::byte{0xff}) {
      entry[major_at] =
          static_cast<std::byte>(known_.majors.of(std::to_integer<std::uint16_t>(entry[major_at])));
    }
    const auto type = std::to_integer<unsigned>(entry[0]);
    if (type == 6 || type == 7) {
      rename_field(known_.eventgroups, entry + eventgroup_at);
    }
  }
  static void rename_field(Names& names, std::byte* field) {
    if (const auto recorded = someip::load<std::uint16_t>(field); recorded != 0xffff) {
      someip::store(field, names.of(recorded));
    }
  }

  Seeds seeds_;
  Input input_;
  std::optional<pcaps::Timestamp> last_;
  Known known_;
};

}  // namespace trestle::fuzz
