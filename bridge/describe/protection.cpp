#include "bridge/describe/protection.hpp"

#include <algorithm>
#include <string_view>

#include "someip/core/e2e/config.hpp"

namespace trestle::describe {

std::optional<ProtectionHeader> protection_header(const Protection& e2e) {
  if (e2e.profile.empty()) {
    return ProtectionHeader{};
  }
  static const std::map<std::string, std::size_t, std::less<>> sizes{
      {"1", 2},   {"2", 2},  {"4", 12},  {"4m", 16}, {"5", 3},  {"6", 5},   {"7", 20},
      {"7m", 24}, {"8", 16}, {"8m", 20}, {"11", 2},  {"22", 2}, {"44", 12}, {"44m", 16}};
  const auto size = sizes.find(e2e.profile);
  if (size == sizes.end()) {
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
  return ProtectionHeader{static_cast<std::size_t>((begin - front) / 8), size->second};
}

}  // namespace trestle::describe
