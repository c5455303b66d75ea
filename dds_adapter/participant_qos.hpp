#pragma once
#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::dds::detail {

/// Everything that Fast DDS has to know of a participant, but its domain.
/// @throws DdsError  for profiles, servers and keys that cannot be used: says which.
[[nodiscard]] fast::DomainParticipantQos participant_qos(const ParticipantConfig& config);

}  // namespace trestle::dds::detail
