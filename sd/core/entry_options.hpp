#pragma once
#include "sd/core/settings.hpp"
#include "sd/wire/message.hpp"
#include "sd/wire/offer_options.hpp"

namespace trestle::sd {

/// Which addresses a peer may have or name, and which options.
class OptionRules {
 public:
  /// @param settings  must outlive this object
  explicit OptionRules(const Settings& settings) noexcept : settings_{settings} {}

  /// Whether `address` can be a peer's: of our IP version, unicast, not unspecified, not broadcast, not our
  /// own, in our subnet where that is checked. Loopback addresses are other nodes of this host when our own
  /// address is one, else wrong where that is checked.  [feat_req_someipsd_1233] [feat_req_someipsd_1135]
  [[nodiscard]] bool allow(const IpAddress& address) const noexcept;
  /// Whether a sender at `peer` may name endpoints at `named`: its own, or as the configuration allows.
  [[nodiscard]] bool may_name(const IpAddress& peer, const IpAddress& named) const noexcept;
  [[nodiscard]] bool v6() const noexcept { return own().v6; }
  /// Whether the application may name `endpoint`, if it does: of our IP version, unicast, not unspecified.
  [[nodiscard]] bool allow_own(const std::optional<Endpoint>& endpoint) const noexcept;
  /// Whether an entry cannot be used that references `option`, for its type alone.
  [[nodiscard]] bool refuses(const Option& option) const noexcept {
    return settings_.refuse_unknown_options && !is_known(option.type) && !option.discardable();
  }

 private:
  [[nodiscard]] const IpAddress& own() const noexcept { return settings_.unicast.address; }

  const Settings& settings_;
};

/// What an entry references, except its configuration, of which it has the receive buffer only. All endpoints
/// are of our IP version.
struct EntryOptions {
  std::optional<Endpoint> udp;
  std::optional<Endpoint> tcp;
  std::optional<Endpoint> multicast;  ///< of a SubscribeEventgroupAck
  OfferOptions offer;
  std::uint32_t receive_buffer_bytes = 0;  ///< of a subscriber that tells it; else 0
};

/// Why an entry cannot be used because of its options.
enum class OptionFault : std::uint8_t {
  missing,    ///< a run points beyond the options array, or behind a broken option
  malformed,  ///< a length or a configuration that does not fit the option's type
  endpoint,   ///< an endpoint that cannot be one: address, port or protocol  [feat_req_someipsd_1164]
  unknown,    ///< of an unknown type, where the settings refuse such  [feat_req_someipsd_102]
  conflict,   ///< two different options of the same kind  [feat_req_someipsd_1144]
};

/// Reads and checks what `entry` of `message` references: unicast endpoints, or the multicast endpoint when
/// it is a SubscribeEventgroupAck [feat_req_someipsd_854].
///
/// Options that are unknown [feat_req_someipsd_1142], or of no use for this type of entry
/// [feat_req_someipsd_1141], are ignored; see Settings::refuse_unknown_options.
[[nodiscard]] tl::expected<EntryOptions, OptionFault> read_options(const SdMessage& message,
                                                                   const Entry& entry,
                                                                   const OptionRules& rules) noexcept;

/// The endpoint of the message's first SD endpoint option of our IP version, which then stands for the sender
/// in place of the datagram's source; nothing without one, or with one that cannot be.
/// [feat_req_someipsd_1084] [feat_req_someipsd_1100] [feat_req_someipsd_1152] [feat_req_someipsd_1154]
[[nodiscard]] std::optional<Endpoint> sd_endpoint(const SdMessage& message,
                                                  const OptionRules& rules) noexcept;

}  // namespace trestle::sd
