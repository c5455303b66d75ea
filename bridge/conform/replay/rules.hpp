// bridge/conform/replay: verdicts from a capture alone.
//
//   rules.hpp   what is judged: each rule is a Case without a way to run it
//   replay.hpp  reads captures, and judges each message by the rules
//   rpc_judge.cpp, sd_judge.cpp, tp_judge.cpp  requests and events; service discovery; segments
//   stream_judge.cpp, option_judge.cpp, subscription_judge.cpp  Magic Cookies and connections; options;
//               offers and subscriptions over time
//   service_judge.cpp  messages of services that the capture shows offers of
//
// As the tester, it is written from the catalogue on top of the codecs alone.
#pragma once
#include <cstdint>
#include <vector>

#include "bridge/conform/case.hpp"

namespace trestle::conform {

enum class Rule : std::uint8_t {
  header_length,
  header_protocol,
  header_type,
  header_code,
  ids_service,
  ids_method,
  ids_event,
  ids_reserved,
  ids_one_meaning,
  rpc_session,
  rpc_session_counts,
  rpc_event_session,
  rpc_response_asked,
  rpc_response_once,
  rpc_response_version,
  rpc_interface_version,
  rpc_event_source,
  udp_size,
  tcp_cookie,
  tcp_cookie_interval,
  tcp_one_connection,
  sd_port,
  sd_header,
  sd_session,
  sd_session_order,
  sd_reboot_flag,
  sd_unicast_flag,
  sd_reserved,
  sd_initial_data_flag,
  sd_arrays,
  sd_entries,
  sd_entry_type,
  sd_entry_reserved,
  sd_instance_id,
  sd_eventgroup_id,
  sd_empty_run,
  sd_run,
  sd_option_layout,
  sd_option_reserved,
  sd_option_repeated,
  sd_option_protocol,
  sd_endpoint_port,
  sd_multicast_address,
  sd_configuration,
  sd_load_balancing,
  sd_sd_endpoint,
  sd_mac_groupcast,
  sd_otherserv,
  sd_offer_endpoint,
  sd_option_counts,
  sd_unicast_only,
  sd_find_minor,
  sd_stop_offer,
  sd_instance_endpoints,
  sd_subscribe_endpoint,
  sd_subscribe_address,
  sd_subscribe_transport,
  sd_one_subscriber,
  sd_stop_subscribe,
  sd_stop_then_subscribe,
  sd_subscribe_answered,
  sd_ack_asked,
  sd_ack_ttl,
  sd_event_after_ack,
  tp_session,
  tp_length,
  tp_reserved,
  tp_order,
  tp_overlap,
  tp_equal,
  tp_largest,
  tp_header,
  count,
};

/// In the order of Rule.
[[nodiscard]] const std::vector<Case>& replay_rules();

}  // namespace trestle::conform
