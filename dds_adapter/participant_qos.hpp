#pragma once
#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/participant.hpp"
#include "dds_adapter/sample_sockets.hpp"

namespace trestle::dds::detail {

/// Buffers that sockets of UDP ask for; buffers_not_granted() tells what of it is not given. A 4 MB sample is
/// 64 datagrams at once.
inline constexpr std::uint32_t socket_buffer_bytes = 16U << 20U;

/// Everything that Fast DDS has to know of a participant, but its domain.
/// @param sockets  that are to receive by UDP; none: threads of DDS do.
/// @throws DdsError  for profiles, servers and keys that cannot be used: says which.
[[nodiscard]] fast::DomainParticipantQos participant_qos(const ParticipantConfig& config,
                                                         const std::shared_ptr<SampleSockets>& sockets);

}  // namespace trestle::dds::detail
