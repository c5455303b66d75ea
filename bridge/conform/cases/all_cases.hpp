// bridge/conform/cases: what a device has to do, a file for each area of it.
//
//   sd_messages.cpp    headers, flags, offers, options of SD messages
//   sd_finds.cpp       FindService and its answers
//   sd_subscribe.cpp   SubscribeEventgroup: acknowledged, refused, ended, forgotten
//   sd_malformed.cpp   what looks like a Subscribe and is none
//   sd_options.cpp     explicit initial data, other options than endpoints, several versions of a service
//   sd_phases.cpp      timing of offers, start, stop, reboot
//   rpc.cpp            requests, responses, errors, fields
//   events.cpp         events and initial values
//   tcp.cpp            requests and events over TCP
//   tp.cpp             large messages in segments
//   client.cpp         the device as a client; client_ets.cpp: driven by the Enhanced Testability Service
//   our_service.hpp    the service that the tester offers to it
//   e2e.cpp            end-to-end protection
//   load.cpp           bursts, floods, more peers than there is room for, connections that stay half open
//   ets_echo.cpp       payloads, by the Enhanced Testability Service
//
// docs/conform.md shows how to write one. A file here sees neither sockets nor Asio.
#pragma once
#include <vector>

#include "bridge/conform/case.hpp"

namespace trestle::conform {

/// All that there are, in the order in which they are run and listed.
[[nodiscard]] const std::vector<Case>& all_cases();

using Cases = std::vector<Case>;
void add_sd_message_cases(Cases& cases);
void add_sd_find_cases(Cases& cases);
void add_sd_subscribe_cases(Cases& cases);
void add_sd_malformed_cases(Cases& cases);
void add_sd_option_cases(Cases& cases);
void add_sd_phase_cases(Cases& cases);
void add_rpc_cases(Cases& cases);
void add_event_cases(Cases& cases);
void add_tcp_cases(Cases& cases);
void add_tp_cases(Cases& cases);
void add_client_cases(Cases& cases);
void add_ets_client_cases(Cases& cases);
void add_e2e_cases(Cases& cases);
void add_load_cases(Cases& cases);
void add_ets_echo_cases(Cases& cases);

}  // namespace trestle::conform
