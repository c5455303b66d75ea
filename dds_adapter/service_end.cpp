#include "dds_adapter/service_end.hpp"

#include <algorithm>

namespace trestle::dds::detail {

Qos service_qos(const ServiceConfig& config) {
  const auto depth = static_cast<std::uint32_t>(std::clamp<std::size_t>(config.max_calls, 10, 65536));
  return {.reliable = true, .transient_local = false, .depth = depth};
}

void FoundReaders::change(const Guid& reader, bool matched, Vendor vendor) {
  if (matched) {
    // A Fast DDS writer reaches Fast DDS readers at once.
    readers_.insert_or_assign(reader, Found{vendor, vendor == Vendor::fast_dds});
  } else {
    readers_.erase(reader);
  }
}

bool FoundReaders::is_there(const Guid& reader) const {
  const auto found = readers_.find(reader);
  return found != readers_.end() && found->second.reached;
}

bool FoundReaders::any_there(const std::function<bool(const Guid&, Vendor)>& of_these) const {
  return std::ranges::any_of(readers_, [&](const auto& reader) {
    return reader.second.reached && of_these(reader.first, reader.second.vendor);
  });
}

std::vector<Guid> FoundReaders::not_reached() const {
  std::vector<Guid> result;
  for (const auto& [reader, found] : readers_) {
    if (!found.reached) {
      result.push_back(reader);
    }
  }
  return result;
}

void FoundReaders::is_reached(const Guid& reader) {
  if (const auto found = readers_.find(reader); found != readers_.end()) {
    found->second.reached = true;
  }
}

std::optional<TimePoint> look_at(FoundReaders& readers, std::mutex& mutex, Writer& writer, TimePoint now) {
  constexpr std::chrono::milliseconds interval{10};
  std::vector<Guid> lacking;
  {
    const std::lock_guard lock{mutex};
    lacking = readers.not_reached();
  }
  std::optional<TimePoint> again;
  for (const Guid& reader : lacking) {
    if (writer.reaches(reader)) {
      const std::lock_guard lock{mutex};
      readers.is_reached(reader);
    } else {
      again = now + interval;
    }
  }
  return again;
}

std::optional<TimePoint> earlier(std::optional<TimePoint> left, std::optional<TimePoint> right) {
  return !left ? right : !right ? left : std::min(left, right);
}

}  // namespace trestle::dds::detail
