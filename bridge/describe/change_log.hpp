#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/compare.hpp"

namespace trestle::describe::comparing {

/// "0x1234"; empty: there is none.
template <typename Id>
[[nodiscard]] std::string text_of(const std::optional<Id>& id);
[[nodiscard]] std::string hex_of(std::uint32_t number);

/// "Door.open" of "Door" and "open"; the element alone where there is no name.
[[nodiscard]] std::string path_of(const std::string& element, const std::string& name);

/// The changes that were found so far.
class ChangeLog {
 public:
  void add(std::string_view rule, std::string element, std::string before, std::string after, Place old_place,
           Place new_place);
  /// When the two differ.
  void differs(std::string_view rule, const std::string& element, std::string before, std::string after,
               Place old_place, Place new_place);
  /// When the two differ, but for how ROS spells names where one side is a route file.
  void renamed(std::string_view rule, const std::string& element, const std::string& before,
               const std::string& after, Place old_place, Place new_place);
  void take_names_of_ros(bool they_are) { ros_names_ = they_are; }
  /// Whether one side leaves open how everything is carried: such changes are left out from here on.
  void leave_out_deployment(bool it_is_open) { is_deployment_open_ = it_is_open; }
  /// How many were left out.
  [[nodiscard]] std::size_t left_out() const noexcept { return left_out_; }

  /// A change that is true of another element, too.
  void also(std::size_t change, std::string element);

  [[nodiscard]] std::size_t size() const noexcept { return changes_.size(); }
  [[nodiscard]] const std::string& element_of(std::size_t change) const { return changes_[change].element; }
  [[nodiscard]] std::vector<Change> take() { return std::move(changes_); }

 private:
  std::vector<Change> changes_{};
  std::size_t also_count_ = 0;
  bool ros_names_ = false;
  bool is_deployment_open_ = false;
  std::size_t left_out_ = 0;
};

template <typename Id>
std::string text_of(const std::optional<Id>& id) {
  return id ? hex_of(static_cast<std::uint32_t>(*id)) : std::string{};
}

}  // namespace trestle::describe::comparing
