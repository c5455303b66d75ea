#include "dds_adapter/service_form.hpp"

#include <algorithm>
#include <atomic>

#include "someip/wire/enumerator_name.hpp"

namespace trestle::dds {

namespace detail {
namespace {

constexpr std::size_t encapsulation_size = 4;

bool is_little_endian(ByteView encapsulation) {
  return encapsulation[1] == std::byte{1};
}

}  // namespace

std::optional<InlineHeader> inline_header(ByteView cdr) {
  if (cdr.size() < encapsulation_size + inline_header_bytes) {
    return std::nullopt;
  }
  const bool little = is_little_endian(cdr);
  const auto number_at = [&](std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      value = value << 8U | std::to_integer<std::uint64_t>(cdr[at + (little ? 7 - i : i)]);
    }
    return value;
  };
  return InlineHeader{number_at(encapsulation_size),
                      static_cast<std::int64_t>(number_at(encapsulation_size + 8))};
}

std::vector<std::byte> without_inline_header(ByteView cdr) {
  // The encapsulation header takes the place of the last bytes of the inline header.
  const ByteView kept = cdr.subspan(inline_header_bytes);
  std::vector<std::byte> result{kept.begin(), kept.end()};
  std::ranges::copy(cdr.first(encapsulation_size), result.begin());
  return result;
}

SlicesWithHeader::SlicesWithHeader(std::span<const ByteView> slices, const InlineHeader& header) {
  slices_.emplace_back();  // for front_, set below
  std::size_t filled = 0;  // bytes of the encapsulation header, which slices may cut anywhere
  for (const ByteView slice : slices) {
    const std::size_t taken = std::min(slice.size(), encapsulation_size - filled);
    std::ranges::copy(slice.first(taken), std::span{front_}.subspan(filled).begin());
    filled += taken;
    if (taken < slice.size()) {
      slices_.push_back(slice.subspan(taken));
    }
  }
  if (filled < encapsulation_size) {
    slices_.front() = ByteView{front_}.first(filled);  // the writer refuses such a short sample
    return;
  }
  const bool little = is_little_endian(front_);
  const auto put = [&](std::size_t at, std::uint64_t value) {
    for (std::size_t i = 0; i < 8; ++i) {
      front_[at + (little ? i : 7 - i)] = static_cast<std::byte>(value >> 8 * i);
    }
  };
  put(encapsulation_size, header.client);
  put(encapsulation_size + 8, static_cast<std::uint64_t>(header.number));
  slices_.front() = front_;
}

std::vector<std::byte> joined(std::span<const ByteView> slices) {
  std::vector<std::byte> result;
  for (const ByteView slice : slices) {
    result.insert(result.end(), slice.begin(), slice.end());
  }
  return result;
}

bool same_participant(const Guid& left, const Guid& right) noexcept {
  return participant_of(left) == participant_of(right);
}

RosForm form_of(RosForm configured, Vendor peer) noexcept {
  if (configured != RosForm::automatic) {
    return configured;
  }
  return peer == Vendor::cyclone_dds ? RosForm::cyclonedds : RosForm::fastrtps;
}

std::string pairing_user_data(std::string_view key, const Participant& participant) {
  static std::atomic<std::uint32_t> last{0};
  return std::string{key} + "=" + participant.guid() + "." + std::to_string(++last) + ";";
}

}  // namespace detail

const char* to_string(RosForm form) noexcept {
  static constexpr std::array names{"auto", "fastrtps", "cyclonedds"};
  return someip::enumerator_name<RosForm::cyclonedds>(names, form, "?");
}

const char* to_string(CallFault fault) noexcept {
  static constexpr std::array names{"unavailable", "too_many", "not_written", "timed_out", "gone"};
  return someip::enumerator_name<CallFault::gone>(names, fault, "?");
}

}  // namespace trestle::dds
