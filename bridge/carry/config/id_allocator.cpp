#include "bridge/carry/config/id_allocator.hpp"

#include <string>

namespace trestle::carry {

std::uint32_t fnv1a(std::string_view text) noexcept {
  std::uint32_t hash = 2166136261U;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  }
  return hash;
}

std::optional<someip::ServiceId> choose_service(ServiceRange range, std::string_view topic,
                                                std::string_view type,
                                                const std::function<bool(someip::ServiceId)>& is_taken) {
  const std::uint32_t first = someip::value(range.first);
  const std::uint32_t count = someip::value(range.last) - first + 1U;
  const std::uint32_t hash = fnv1a(std::string{topic} + ' ' + std::string{type});
  for (std::uint32_t step = 0; step < count; ++step) {
    const someip::ServiceId id{static_cast<std::uint16_t>(first + (hash % count + step) % count)};
    if (!is_taken(id)) {
      return id;
    }
  }
  return std::nullopt;
}

}  // namespace trestle::carry
