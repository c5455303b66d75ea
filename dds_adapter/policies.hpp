#pragma once
#include <string>
#include <string_view>

#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::dds::detail {

/// @throws DdsError  unless the names are usable and the quality of service makes sense.
void check_endpoint(std::string_view what, std::string_view topic, std::string_view type, const Qos& qos);

/// The policies by which a reader does not match a writer by the rules of RTPS, by name; empty: they match.
[[nodiscard]] std::string differing_policies(const Qos& offered, const Qos& wanted);

/// The policies whose count has risen since `seen`, by name; brings `seen` up to date.
[[nodiscard]] std::string risen_policies(const fast::QosPolicyCountSeq& now, fast::QosPolicyCountSeq& seen);

}  // namespace trestle::dds::detail
