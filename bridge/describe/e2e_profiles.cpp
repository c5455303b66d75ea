#include "bridge/describe/e2e_profiles.hpp"

#include <algorithm>
#include <array>
#include <variant>

namespace trestle::describe {
namespace {

namespace e2e = someip::e2e;

constexpr std::array profiles{
    E2eProfile{"1", e2e::Profile1{}, 2},          E2eProfile{"2", e2e::Profile2{}, 2},
    E2eProfile{"4", e2e::Profile4{}, 12},         E2eProfile{"5", e2e::Profile5{}, 3},
    E2eProfile{"6", e2e::Profile6{}, 5},          E2eProfile{"7", e2e::Profile7{}, 20},
    E2eProfile{"8", e2e::Profile8{}, 16},         E2eProfile{"11", e2e::Profile11{}, 2},
    E2eProfile{"22", e2e::Profile22{}, 2},        E2eProfile{"44", e2e::Profile44{}, 12},
    E2eProfile{"4m", e2e::Profile4m{}, 16, true}, E2eProfile{"7m", e2e::Profile7m{}, 24, true},
    E2eProfile{"8m", e2e::Profile8m{}, 20, true}, E2eProfile{"44m", e2e::Profile44m{}, 16, true}};
static_assert(profiles.size() == std::variant_size_v<e2e::Config>);

}  // namespace

std::span<const E2eProfile> e2e_profiles() noexcept {
  return profiles;
}

const E2eProfile& e2e_profile(const e2e::Config& settings) noexcept {
  return *std::ranges::find(profiles, settings.index(),
                            [](const E2eProfile& one) { return one.settings.index(); });
}

}  // namespace trestle::describe
