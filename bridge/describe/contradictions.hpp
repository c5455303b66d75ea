#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// A value as messages have it, and where a source says it.
struct SaidValue {
  std::string value;
  Place place;
};

/// Tells of what two sources, or two places of one, say differently: at the second, with both values and the
/// place of the first.
class Contradictions {
 public:
  using Tell = std::function<void(const Place& place, std::string text)>;

  /// @param model  names the files of places, and knows which are configurations of vsomeip, and of which
  ///               instances a capture shows the offers.
  /// @param warn  tells of what is settled by a rule: see settle().
  Contradictions(const Model& model, Tell tell, Tell warn);

  /// @param what  "the UDP port", which the value follows.
  void add(std::string_view element, std::string_view what, const SaidValue& first, const SaidValue& second);

  /// The same of an address or another setting of a host. It is a warning if one of the two is nearer to the
  /// host: a configuration of vsomeip is what its stack reads, and a capture shows what a host did, while
  /// other sources describe interfaces.
  /// @return whether the second value holds.
  bool settle(std::string_view element, std::string_view what, const SaidValue& first,
              const SaidValue& second);

  /// Of two hosts whose configurations both list a service. Which one offers it is up to the applications.
  void warn_of_two_hosts(std::string_view element, const SaidValue& first, const SaidValue& second);

  /// Whether it is in a configuration of vsomeip.
  [[nodiscard]] bool is_configuration(const Place& place) const;
  /// Whether settle() takes neither before the other.
  [[nodiscard]] bool are_alike(const Place& first, const Place& second) const {
    return origin_of(first) == origin_of(second);
  }

  /// Tells unless the values are the same.
  void compare(std::string_view element, std::string_view what, const SaidValue& first,
               const SaidValue& second) {
    if (first.value != second.value) {
      add(element, what, first, second);
    }
  }

  /// How many were told.
  [[nodiscard]] std::size_t count() const noexcept { return told_.size(); }

 private:
  enum class Origin : std::uint8_t { description, capture, configuration };
  [[nodiscard]] Origin origin_of(const Place& place) const;
  void tell_once(const Tell& tell, const Place& place, std::string text);

  const Model& model_;
  std::set<std::uint32_t> captures_{};  ///< files
  Tell tell_;
  Tell warn_;
  std::set<std::string> told_{};  ///< a request and its answer may have one setting
};

}  // namespace trestle::describe
