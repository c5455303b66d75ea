#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dds_adapter/service.hpp"

namespace trestle::dds::detail {

/// What rmw_cyclonedds puts between the encapsulation header and the body, in the message's byte order.
struct InlineHeader {
  std::uint64_t client = 0;
  std::int64_t number = 0;
};
inline constexpr std::size_t inline_header_bytes = 16;

/// Nothing when the sample is too short for one.
[[nodiscard]] std::optional<InlineHeader> inline_header(ByteView cdr);
/// The sample without it. Its 16 bytes change nothing in the body, where nothing is aligned to more than 8.
[[nodiscard]] std::vector<std::byte> without_inline_header(ByteView cdr);

/// The slices of a sample with an inline header put in. Valid for as long as this object and the slices are.
class SlicesWithHeader {
 public:
  SlicesWithHeader(std::span<const ByteView> slices, const InlineHeader& header);
  SlicesWithHeader(const SlicesWithHeader&) = delete;
  SlicesWithHeader& operator=(const SlicesWithHeader&) = delete;
  [[nodiscard]] std::span<const ByteView> slices() const noexcept { return slices_; }

 private:
  std::array<std::byte, 4 + inline_header_bytes> front_{};
  std::vector<ByteView> slices_;
};

[[nodiscard]] std::vector<std::byte> joined(std::span<const ByteView> slices);

[[nodiscard]] bool same_participant(const Guid& left, const Guid& right) noexcept;

/// The form that a peer speaks.
[[nodiscard]] RosForm form_of(RosForm configured, Vendor peer) noexcept;

/// What rmw_cyclonedds knows the two ends of a client or server by: `key` is "clientid" or "serviceid". Its
/// servers wait with a reply until they have found the reader of such a client.
[[nodiscard]] std::string pairing_user_data(std::string_view key, const Participant& participant);

}  // namespace trestle::dds::detail
