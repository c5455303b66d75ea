// someip/core: the rules of SOME/IP, without sockets, clock, threads, exceptions or heap.
//
//   session_counter.hpp  sessions of what we send
//   call_table.hpp       our calls that wait for an answer
//   request_check.hpp    how a server judges a request, and answers a wrong one
//   stream_parser.hpp    messages in a TCP stream
//   tp_segmenter.hpp     cutting large messages; tp_pacing.hpp: when each part may be sent
//   tp_reassembler.hpp   putting them together again
//   update_schedule.hpp  when the value of a field or event is sent
//   e2e/                 end-to-end protection
//
// This file, guards.hpp, is the switch for what only a hostile network makes necessary.
#pragma once

namespace trestle {

/// Whether the core defends against hostile or faulty peers beyond what the specification demands: fair
/// shares of full tables, limits of rate for each peer, doubts about who a peer is. Without guards everything
/// is still bounded and safe in memory, but one peer can take what the others need. A closed network may
/// leave them out, and saves flash memory.
///
/// CMake's option TRESTLE_GUARDS. All that includes the core's headers has to agree: its targets pass it on.
#ifdef TRESTLE_GUARDS
inline constexpr bool guards = TRESTLE_GUARDS != 0;
#else
inline constexpr bool guards = true;
#endif

}  // namespace trestle
