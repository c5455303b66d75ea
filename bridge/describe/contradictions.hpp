#pragma once
#include <cstddef>
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

  /// @param model  names the files of places.
  Contradictions(const Model& model, Tell tell) : model_{model}, tell_{std::move(tell)} {}

  /// @param what  "the UDP port", which the value follows.
  void add(std::string_view element, std::string_view what, const SaidValue& first, const SaidValue& second);

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
  const Model& model_;
  Tell tell_;
  std::set<std::string> told_{};  ///< a request and its answer may have one setting
};

}  // namespace trestle::describe
