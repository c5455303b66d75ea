#include "bridge/describe/protection.hpp"

#include <algorithm>
#include <string_view>

#include "bridge/describe/e2e_profiles.hpp"
#include "someip/core/e2e/config.hpp"

namespace trestle::describe {

std::optional<ProtectionHeader> protection_header(const Protection& e2e) {
  if (e2e.profile.empty()) {
    return ProtectionHeader{};
  }
  const auto profiles = e2e_profiles();
  const auto profile = std::ranges::find(profiles, std::string_view{e2e.profile}, &E2eProfile::name);
  if (profile == profiles.end()) {
    return std::nullopt;
  }
  const auto only = e2e.words.find("payload_only");
  const std::uint64_t front =
      only != e2e.words.end() && only->second == "true" ? 0 : someip::e2e::someip_offset_bits;
  std::uint64_t begin = front;
  if (e2e.profile == "1" || e2e.profile == "11") {
    const auto offset = [&](std::string_view key, std::uint64_t otherwise) {
      const auto found = e2e.numbers.find(key);
      return found == e2e.numbers.end() ? otherwise : found->second;
    };
    begin = std::min(offset("crc_offset_bits", front), offset("counter_offset_bits", front + 8));
  } else if (const auto offset = e2e.numbers.find("offset_bits"); offset != e2e.numbers.end()) {
    begin = offset->second;
  }
  if (begin < front) {
    return std::nullopt;
  }
  return ProtectionHeader{static_cast<std::size_t>((begin - front) / 8), profile->header_bytes};
}

}  // namespace trestle::describe
