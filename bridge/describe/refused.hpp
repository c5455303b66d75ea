#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "bridge/describe/lower.hpp"

namespace trestle::describe {

/// Fields and constants of all members together, those of nested messages counted at each use: more are not
/// looked at.
inline constexpr std::size_t max_judged_fields = 20'000'000;

/// Takes those members out of `lowered` that a bridge would refuse, because no message can be converted under
/// their rules, or because ROS has no service for such a field. Says why in `not_carried`. The judge is the
/// compiler of conversions itself, so that routes that are written are routes that are taken.
/// @param model  that was lowered.
void leave_out_refused(const Model& model, Lowered& lowered);

/// Why a member of a service is not among Lowered::members.
/// @param member  its name, or its member_key().
[[nodiscard]] std::string why_not_carried(const Lowered& lowered, const Service& service,
                                          std::string_view member);

}  // namespace trestle::describe
