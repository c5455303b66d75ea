#pragma once
#include <cstddef>
#include <string>

#include "bridge/describe/read/problems.hpp"

namespace trestle::describe {

/// Counts what a reader copies because several elements refer to it: a small file could ask for a copy of a
/// long list at each place of another long list. Real systems have far less than 1,000,000,
/// which take about 300 MB.
class Copies {
 public:
  Copies(Problems& problems, std::size_t most) : problems_{problems}, most_{most} {}

  /// @param parts  members, arguments, enumerators, names of errors; and of_text() of long texts.
  /// @return false: these would be too many, which was told once, as an error. Copy nothing then.
  [[nodiscard]] bool take(const Place& place, std::size_t parts) {
    if (is_full_ || parts > most_ - taken_) {
      if (!is_full_) {
        problems_.error(place,
                        "what several elements refer to is copied for each of them, and up to here these are "
                        "more than " +
                            std::to_string(most_) + " members, arguments, enumerators and errors");
      }
      is_full_ = true;
      return false;
    }
    taken_ += parts;
    return true;
  }
  [[nodiscard]] bool full() const noexcept { return is_full_; }

  /// An event, method or field without its values.
  static constexpr std::size_t of_member = 4;
  /// Of texts only long ones count: they take as much as so many members.
  static constexpr std::size_t of_text(std::size_t bytes) noexcept { return bytes / 250; }
  static std::size_t of_text(const Notes& notes) {
    std::size_t bytes = notes.description.size() + notes.unit.size();
    for (const auto& [key, text] : notes.others) {
      bytes += key.size() + text.size();
    }
    return of_text(bytes);
  }

 private:
  Problems& problems_;
  std::size_t most_;
  std::size_t taken_ = 0;
  bool is_full_ = false;
};

}  // namespace trestle::describe
