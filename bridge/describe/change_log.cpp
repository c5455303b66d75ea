#include "bridge/describe/change_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "bridge/describe/change_rules.hpp"
#include "bridge/describe/ros_names.hpp"

namespace trestle::describe::comparing {

namespace {

/// What a deployment says beside the ids.
constexpr std::array<std::string_view, 12> of_deployment{"event-eventgroups",
                                                         "event-eventgroups-added",
                                                         "transport",
                                                         "segmentation",
                                                         "collecting",
                                                         "byte-order",
                                                         "alignment",
                                                         "protection",
                                                         "layout",
                                                         "size-fixed",
                                                         "size-raised",
                                                         "size-lowered"};

}  // namespace

std::string hex_of(std::uint32_t number) {
  return fmt::format("0x{:04x}", number);
}

std::string path_of(const std::string& element, const std::string& name) {
  return name.empty() ? element : element + "." + name;
}

void ChangeLog::add(std::string_view rule, std::string element, std::string before, std::string after,
                    Place old_place, Place new_place) {
  if (is_deployment_open_ && std::ranges::find(of_deployment, rule) != of_deployment.end()) {
    ++left_out_;
    return;
  }
  changes_.push_back({.rule = &comparing::rule(rule),
                      .element = std::move(element),
                      .before = std::move(before),
                      .after = std::move(after),
                      .old_place = old_place,
                      .new_place = new_place});
}

void ChangeLog::differs(std::string_view rule, const std::string& element, std::string before,
                        std::string after, Place old_place, Place new_place) {
  if (before != after) {
    add(rule, element, std::move(before), std::move(after), old_place, new_place);
  }
}

void ChangeLog::renamed(std::string_view rule, const std::string& element, const std::string& before,
                        const std::string& after, Place old_place, Place new_place) {
  if (!ros_names_ || ros_field_name(before) != ros_field_name(after)) {
    differs(rule, element, before, after, old_place, new_place);
  }
}

void ChangeLog::also(std::size_t change, std::string element) {
  constexpr std::size_t most_of_all = 100'000;
  if (also_count_ < most_of_all && changes_[change].element != element) {
    changes_[change].also.push_back(std::move(element));
    ++also_count_;
  }
}

}  // namespace trestle::describe::comparing
