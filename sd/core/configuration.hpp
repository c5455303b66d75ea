#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "sd/wire/message.hpp"

namespace trestle::sd {

/// The Service ID of all that is not SOME/IP: a configuration item tells what it is. [feat_req_someipsd_500]
/// [feat_req_someip_624]
inline constexpr ServiceId other_protocols{0xfffe};
/// The key of that item; its value is the service's name.
inline constexpr std::string_view otherserv = "otherserv";

/// The name of a service that is not SOME/IP, in the body of a configuration option: the value of its one
/// `otherserv` item. Empty when there is none, several, or one without a value, as all of them name nothing.
/// [feat_req_someipsd_500] [feat_req_someipsd_1228]
[[nodiscard]] std::string_view otherserv_of(ByteView configuration) noexcept;

/// The items of all configuration options of one entry.
struct MergedConfiguration {
  ByteView body;      ///< as of one option, at the front of the room; empty when the entry references none
  bool whole = true;  ///< false when items were left out that `room` is too small for
};

/// Puts the items of all configuration options that `entry` references behind each other, in their order and
/// with all duplicates.  [feat_req_someipsd_1146] [feat_req_someipsd_1147] [feat_req_someipsd_684]
[[nodiscard]] MergedConfiguration merge_configurations(const SdMessage& message, const Entry& entry,
                                                       ByteSpan room) noexcept;

namespace slots {
/// How much of a block of configuration memory is used.
struct ConfigurationBlock {
  std::uint16_t bytes = 0;
  bool referenced = false;  // scratch of the search for one that is not
};
}  // namespace slots

/// The configurations of offers, requirements and remote services, in the caller's memory. Who has the same
/// shares a block; a block that nobody references any more is found when one is needed.
class ConfigurationPool {
 public:
  static constexpr std::uint16_t none = 0xffff;
  /// Names the configuration that was read last, before it is kept.
  static constexpr std::uint16_t unkept = 0xfffe;

  /// @param bytes   divided evenly among the blocks and a room to read into
  ConfigurationPool(std::span<std::byte> bytes, std::span<slots::ConfigurationBlock> blocks) noexcept
      : bytes_{bytes}, blocks_{blocks}, block_bytes_{bytes.size() / (blocks.size() + 1)} {}

  /// Where the next configuration is to be written.
  [[nodiscard]] ByteSpan room() const noexcept { return block(blocks_.size()); }
  /// Takes `body`, which is at the front of room(), as `unkept`; `none` when it is empty.
  std::uint16_t take(ByteView body) noexcept {
    unkept_ = body;
    return body.empty() ? none : unkept;
  }
  /// Keeps what `unkept` names.
  /// @param mark  calls its argument with each index that is in use
  /// @return its index, or nothing when all blocks are in use.
  template <typename Mark>
  [[nodiscard]] std::optional<std::uint16_t> keep(Mark mark) noexcept {
    if (const auto same = find(unkept_)) {
      return same;
    }
    for (slots::ConfigurationBlock& block : blocks_) {
      block.referenced = false;
    }
    mark([this](std::uint16_t index) {
      if (index < blocks_.size()) {
        blocks_[index].referenced = true;
      }
    });
    return store(unkept_);
  }
  /// The body of an option; empty for `none`. Valid until its last reference is gone and another is kept.
  [[nodiscard]] ByteView operator[](std::uint16_t index) const noexcept;

 private:
  [[nodiscard]] ByteSpan block(std::size_t index) const noexcept;
  [[nodiscard]] std::optional<std::uint16_t> find(ByteView body) const noexcept;
  [[nodiscard]] std::optional<std::uint16_t> store(ByteView body) noexcept;

  std::span<std::byte> bytes_;
  std::span<slots::ConfigurationBlock> blocks_;
  std::size_t block_bytes_;
  ByteView unkept_;
};

}  // namespace trestle::sd
