#pragma once

namespace trestle {

/// Whether the core defends against hostile or faulty peers beyond what the specification demands: fair
/// shares of full tables, limits of rate for each peer, doubts about who a peer is. Without them all is
/// bounded and safe in memory as well, but one peer can take what the others need. A closed network may leave
/// them out, and saves flash memory.
///
/// CMake's option TRESTLE_GUARDS. All that is compiled with the core's headers has to agree: its targets pass
/// TRESTLE_GUARDS=0 on.
#ifdef TRESTLE_GUARDS
inline constexpr bool guards = TRESTLE_GUARDS != 0;
#else
inline constexpr bool guards = true;
#endif

}  // namespace trestle
