#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <type_traits>

namespace trestle::someip {

/// What a counter tells of. Each struct of counters has `for_each_counter(visit)`, which calls
/// `visit(name, count, kind)` for each of its fields: the one list from which they are shown. Names are those
/// that a bridge shows, and are never freed.
enum class CounterKind : std::uint8_t {
  traffic,  ///< what was received, sent or done
  loss,     ///< what was dropped, refused or ignored
  doubt,    ///< what went on, and may be lost beyond
  now,      ///< how many there are at the moment: it ends with what it is of, and has no sum over time
};

/// Adds each counter of `more` to that of `sum`: all fields, which are std::uint64_t, also of inner structs.
template <typename Counters>
constexpr void add_counters(Counters& sum, const Counters& more) noexcept {
  static_assert(std::is_trivially_copyable_v<Counters> && std::is_aggregate_v<Counters> &&
                std::has_unique_object_representations_v<Counters> &&
                alignof(Counters) == alignof(std::uint64_t));
  using Fields = std::array<std::uint64_t, sizeof(Counters) / sizeof(std::uint64_t)>;
  auto fields = std::bit_cast<Fields>(sum);
  const auto added = std::bit_cast<Fields>(more);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    fields[i] += added[i];
  }
  sum = std::bit_cast<Counters>(fields);
}

}  // namespace trestle::someip
