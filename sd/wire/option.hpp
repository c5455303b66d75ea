#pragma once
#include <array>
#include <optional>
#include <string_view>

#include "sd/wire/entry.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::sd {

using someip::Result;

/// The type byte of an option; others than these may come and are kept.  [feat_req_someipsd_122]
enum class OptionType : std::uint8_t {
  configuration = 0x01,     ///< [feat_req_someipsd_152]
  load_balancing = 0x02,    ///< [feat_req_someipsd_146]
  ipv4_endpoint = 0x04,     ///< [feat_req_someipsd_127]
  ipv6_endpoint = 0x06,     ///< [feat_req_someipsd_140]
  ipv4_multicast = 0x14,    ///< [feat_req_someipsd_723]
  mac_groupcast = 0x15,     ///< [feat_req_someipsd_1251]
  ipv6_multicast = 0x16,    ///< [feat_req_someipsd_737]
  ipv4_sd_endpoint = 0x24,  ///< [feat_req_someipsd_1085]
  ipv6_sd_endpoint = 0x26,  ///< [feat_req_someipsd_1101]
};

/// The type's name as it stands above, for logs and reports; "unknown" for others.
[[nodiscard]] const char* to_string(OptionType type) noexcept;
[[nodiscard]] bool is_known(OptionType type) noexcept;

/// An option as it stands in the options array. `body` is what its Length field counts: everything after the
/// type, the reserved byte in front included. It points into the message.  [feat_req_someipsd_133]
struct Option {
  OptionType type{};
  ByteView body;

  /// With the Length and Type fields, in bytes.
  [[nodiscard]] constexpr std::size_t size() const noexcept { return 3 + body.size(); }
  /// Whether a receiver that does not know the option may pass over it.  [feat_req_someipsd_102]
  [[nodiscard]] constexpr bool discardable() const noexcept {
    return !body.empty() && (std::to_integer<unsigned>(body.front()) & 0x80U) != 0;
  }
  friend bool operator==(const Option& a, const Option& b) noexcept;
};

/// A small option together with its bytes.
class OwnedOption {
 public:
  /// Points into this object.
  [[nodiscard]] constexpr Option view() const noexcept { return {type_, ByteView{body_}.first(size_)}; }

 private:
  friend struct EndpointOption;
  friend struct LoadBalancingOption;
  friend struct MacGroupcastOption;
  OptionType type_{};
  std::uint8_t size_ = 0;
  std::array<std::byte, 21> body_{};
};

/// What an endpoint option tells about.
enum class EndpointRole : std::uint8_t {
  unicast,    ///< where a service is reached, or a subscriber  [feat_req_someipsd_752]
  multicast,  ///< where a server sends multicast events to  [feat_req_someipsd_749]
  sd,         ///< the sender's service discovery  [feat_req_someipsd_1081]
};

/// The six kinds of IPv4 and IPv6 endpoint options; `endpoint.address.v6` tells the family.
/// [feat_req_someipsd_129] [feat_req_someipsd_164] [feat_req_someipsd_725] [feat_req_someipsd_739]
/// [feat_req_someipsd_1087] [feat_req_someipsd_1103]
struct EndpointOption {
  EndpointRole role = EndpointRole::unicast;
  Endpoint endpoint{};
  Transport transport = Transport::udp;  ///< may hold any byte after decoding
  std::uint8_t flags = 0;                ///< first reserved byte; its top bit is the discardable flag
  std::uint8_t reserved = 0;             ///< second reserved byte

  [[nodiscard]] OptionType type() const noexcept;
  [[nodiscard]] OwnedOption encode() const noexcept;
  /// @return the option, or
  ///         WireError::bad_value          it is no endpoint option at all;
  ///         WireError::bad_option_length  its length is not 9 (IPv4) or 21 (IPv6).
  [[nodiscard]] static Result<EndpointOption> decode(const Option& option) noexcept;

  friend constexpr bool operator==(const EndpointOption&, const EndpointOption&) = default;
};

/// Ranks the instances of a service, as DNS SRV records do.  [feat_req_someipsd_175]
struct LoadBalancingOption {
  static constexpr OptionType option_type = OptionType::load_balancing;

  std::uint16_t priority = 0;  ///< lower is preferred
  std::uint16_t weight = 0;    ///< larger is more probable among equal priorities
  std::uint8_t flags = 0;      ///< reserved byte; its top bit is the discardable flag

  [[nodiscard]] OwnedOption encode() const noexcept;
  /// @return the option, WireError::bad_value for another type, or bad_option_length when that is not 5.
  [[nodiscard]] static Result<LoadBalancingOption> decode(const Option& option) noexcept;

  friend constexpr bool operator==(const LoadBalancingOption&, const LoadBalancingOption&) = default;
};

/// Where the layer 2 traffic of a service goes to that is not SOME/IP.  [feat_req_someipsd_1252]
/// [feat_req_someipsd_1253]
struct MacGroupcastOption {
  static constexpr OptionType option_type = OptionType::mac_groupcast;
  static constexpr std::size_t max_identifier_bytes = 12;

  std::array<std::uint8_t, 6> address{};
  std::uint16_t protocol = 0;  ///< an Ethertype, such as 0x22f0 for IEEE 1722
  /// What the protocol needs, such as the 8 bytes of an IEEE 1722 stream id: the first `identifier_bytes`.
  std::array<std::uint8_t, max_identifier_bytes> identifier{};
  std::uint8_t identifier_bytes = 0;
  std::uint8_t flags = 0;  ///< reserved byte; its top bit is the discardable flag

  /// `identifier_bytes` must be at most 12.
  [[nodiscard]] OwnedOption encode() const noexcept;
  /// @return the option, or
  ///         WireError::bad_value          another type;
  ///         WireError::bad_option_length  shorter than 9;
  ///         WireError::no_room            its identifier is longer than 12 bytes.
  [[nodiscard]] static Result<MacGroupcastOption> decode(const Option& option) noexcept;

  friend constexpr bool operator==(const MacGroupcastOption&, const MacGroupcastOption&) = default;
};

/// One `key`, `key=` or `key=value` of a configuration option. Points into the message.
struct ConfigurationItem {
  std::string_view key;
  std::optional<std::string_view> value;  ///< nothing without '=', empty after a final '='
};

/// Walks over the items of a configuration option, in their order, equal keys included.
/// [feat_req_someipsd_150] [feat_req_someipsd_684]
class ConfigurationCursor {
 public:
  /// `option` is one of type OptionType::configuration.
  explicit ConfigurationCursor(const Option& option) noexcept;

  /// The next item, or nothing at the end or at the first fault.
  [[nodiscard]] std::optional<ConfigurationItem> next() noexcept;

  /// Why next() stopped early:
  ///   bad_option_length  an item longer than the rest of the option, a missing end mark, or bytes after it
  ///                      [feat_req_someipsd_158];
  ///   bad_value          an item without a key, or with a key that is not printable ASCII
  ///                      [feat_req_someipsd_161] [feat_req_someipsd_162].
  [[nodiscard]] std::optional<WireError> error() const noexcept { return error_; }
  /// Where the next item begins, or the faulty one: in bytes from the start of the option's body.
  [[nodiscard]] std::size_t offset() const noexcept { return offset_; }

 private:
  std::optional<ConfigurationItem> fail(WireError error) noexcept;

  ByteView body_;
  std::size_t offset_ = 1;  // after the reserved byte
  bool ended_ = false;
  std::optional<WireError> error_;
};

/// Writes the body of a configuration option: reserved byte, items, end mark.
/// @return the option, whose body is at the front of `room`;
///         no_room    `room` or the 16 bit Length field is too small;
///         bad_value  an item is longer than 255 bytes, or its key empty, not printable ASCII, or with '='.
[[nodiscard]] Result<Option> encode_configuration(std::span<const ConfigurationItem> items,
                                                  ByteSpan room) noexcept;

/// The first thing wrong inside a single option, judged by the rules of its type: length, reachable values
/// (transport, port, multicast address), configuration syntax. Unknown types are never wrong.
/// [feat_req_someipsd_102]
[[nodiscard]] std::optional<WireError> find_fault(const Option& option) noexcept;

}  // namespace trestle::sd
