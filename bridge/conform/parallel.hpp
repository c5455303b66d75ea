#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "bridge/conform/runner.hpp"

/// Several devices at once, each with a tester of its own: cases mostly wait.
namespace trestle::conform {

/// The same device at other addresses, with multicast groups of its own: 127.x.N.y of loopback, or the IPv6
/// addresses with N in the place of their seventh part, fd00::N:y, where this host has them.
/// @param number  N, from 1; `neighbourhood` is x: processes that run at the same time take different ones.
/// @return nothing when the device is not started by the profile, or cannot be at such addresses.
[[nodiscard]] std::optional<Profile> beside(const Profile& profile, unsigned neighbourhood, unsigned number);

/// The profiles of `jobs` devices beside each other; only the given one when it cannot have others.
[[nodiscard]] std::vector<Profile> neighbours(const Profile& profile, unsigned jobs);

/// How many at once when nobody says it: more than there are cores.
[[nodiscard]] unsigned default_jobs();

/// Does `count` things, each on the first worker that is free. The thread that calls does not work.
/// @throws what the first of them has thrown, after all others have ended.
void share_work(unsigned workers, std::size_t count,
                const std::function<void(unsigned worker, std::size_t index)>& work);

/// run_cases() with a few cases at a time for each of the profiles, so that every few cases have a device
/// that was just started. All callbacks are called by one thread at a time; `on_begin` in any order, `on_end`
/// in the order of the cases, as the results stand.
[[nodiscard]] RunResult run_side_by_side(const std::vector<Profile>& profiles,
                                         const std::vector<const Case*>& cases, const RunOptions& options);

}  // namespace trestle::conform
