#pragma once
#include "dds_adapter/fastdds_compat.hpp"

/// Private to dds_adapter/.
namespace trestle::dds::fast {

/// From now on no writer of this participant matches a reader whose user data tells another type hash than
/// the writer's: nothing is sent there. Readers match such writers all the same, and have to drop what comes:
/// a writer that keeps all would wait for one that does not acknowledge.
///
/// With Fast DDS before 2.10. From 3.0 on discovery can be told to ignore an endpoint, see
/// DiscoveryListener::on_endpoint(); between the two there is no way.
#if TRESTLE_FASTDDS_VERSION >= 21000
inline void refuse_readers_of_other_types(const rtps::GuidPrefix_t& /*participant*/) {}
inline void forget_refusals(const rtps::GuidPrefix_t& /*participant*/) noexcept {}
#else
void refuse_readers_of_other_types(const rtps::GuidPrefix_t& participant);
/// Of a participant that has gone.
void forget_refusals(const rtps::GuidPrefix_t& participant) noexcept;
#endif

}  // namespace trestle::dds::fast
