#pragma once
#include "dds_adapter/fastdds_compat.hpp"

/// Whether match_guard.cpp knows the functions of this Fast DDS.
#define TRESTLE_REFUSES_READERS \
  (TRESTLE_FASTDDS_VERSION < 21000 || (TRESTLE_FASTDDS_VERSION >= 30000 && TRESTLE_FASTDDS_VERSION < 30200))

/// Private to dds_adapter/.
namespace trestle::dds::fast {

/// From now on no writer of this participant matches a reader whose user data tells another type hash than
/// the writer's: nothing is sent there. Readers match such writers all the same, and have to drop what comes:
/// a writer that keeps all would wait for one that does not acknowledge.
///
/// With Fast DDS before 2.10, 3.0 and 3.1; with others there is no way: that discovery can be told to ignore
/// an endpoint, as 3.x has it, means nothing there.
#if !TRESTLE_REFUSES_READERS
inline void refuse_readers_of_other_types(const rtps::GuidPrefix_t& /*participant*/) {}
inline void forget_refusals(const rtps::GuidPrefix_t& /*participant*/) noexcept {}
#else
void refuse_readers_of_other_types(const rtps::GuidPrefix_t& participant);
/// Of a participant that has gone.
void forget_refusals(const rtps::GuidPrefix_t& participant) noexcept;
#endif

}  // namespace trestle::dds::fast
