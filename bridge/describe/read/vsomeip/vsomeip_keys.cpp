#include "bridge/describe/read/vsomeip/vsomeip_keys.hpp"

#include <array>

namespace trestle::describe::vsomeip_keys {
namespace {

using Name = std::string_view;

constexpr std::array root_names{
    Name{"acceptances"},
    Name{"applications"},
    Name{"buffer-shrink-threshold"},
    Name{"clients"},
    Name{"debounce"},
    Name{"device"},
    Name{"diagnosis"},
    Name{"diagnosis_mask"},
    Name{"dispatching"},
    Name{"e2e"},
    Name{"endpoint-queue-limit-external"},
    Name{"endpoint-queue-limit-local"},
    Name{"endpoint-queue-limits"},
    Name{"file-permissions"},
    Name{"internal_services"},
    Name{"local-clients-keepalive"},
    Name{"logging"},
    Name{"max-payload-size-local"},
    Name{"max-payload-size-reliable"},
    Name{"max-payload-size-unreliable"},
    Name{"netmask"},
    Name{"network"},
    Name{"network-options"},
    Name{"npdu-default-timings"},
    Name{"partitions"},
    Name{"payload-sizes"},
    Name{"prefix"},
    Name{"request_debounce_time"},
    Name{"routing"},
    Name{"routing-credentials"},
    Name{"secure-services"},
    Name{"security"},
    Name{"security-update-whitelist"},
    Name{"service-discovery"},
    Name{"servicegroups"},
    Name{"services"},
    Name{"shutdown_timeout"},
    Name{"supports_selective_broadcasts"},
    Name{"suppress_missing_event_logs"},
    Name{"tcp-connect-time-max"},
    Name{"tcp-restart-aborts-max"},
    Name{"tracing"},
    Name{"udp-receive-buffer-size"},
    Name{"uds-preferred"},
    Name{"unicast"},
    Name{"watchdog"},
};
constexpr std::array discovery_names{
    Name{"cyclic_offer_delay"},
    Name{"enable"},
    Name{"find_debounce_time"},
    Name{"find_initial_debounce_reps"},
    Name{"find_initial_debounce_time"},
    Name{"initial_delay_max"},
    Name{"initial_delay_min"},
    Name{"initial_state"},
    Name{"max_remote_subscribers"},
    Name{"multicast"},
    Name{"offer_debounce_time"},
    Name{"offers_watchdog"},
    Name{"port"},
    Name{"protocol"},
    Name{"repetitions_base_delay"},
    Name{"repetitions_max"},
    Name{"request_response_delay"},
    Name{"stop_offer_watchdog_time"},
    Name{"ttl"},
    Name{"ttl_factor_offers"},
    Name{"ttl_factor_subscriptions"},
    Name{"wait_route_netlink_notification"},
};
constexpr std::array npdu_names{
    Name{"debounce-time-request"},
    Name{"debounce-time-response"},
    Name{"max-retention-time-request"},
    Name{"max-retention-time-response"},
};
constexpr std::array group_names{Name{"delays"}, Name{"name"}, Name{"services"}, Name{"unicast"}};
constexpr std::array delay_names{Name{"cyclic-offer"},    Name{"cyclic-request"}, Name{"initial"},
                                 Name{"repetition-base"}, Name{"repetition-max"}, Name{"ttl"}};
constexpr std::array initial_delay_names{Name{"max"}, Name{"maximum"}, Name{"min"}, Name{"minimum"}};
constexpr std::array service_names{Name{"debounce-times"}, Name{"eventgroups"}, Name{"events"},
                                   Name{"instance"},       Name{"multicast"},   Name{"protocol"},
                                   Name{"reliable"},       Name{"service"},     Name{"someip-tp"},
                                   Name{"unicast"},        Name{"unreliable"}};
constexpr std::array port_names{Name{"enable-magic-cookies"}, Name{"magic-cookies"}, Name{"port"}};
constexpr std::array event_names{
    Name{"change_resets_cycle"}, Name{"cycle"},        Name{"event"},           Name{"is_field"},
    Name{"is_reliable"},         Name{"update-cycle"}, Name{"update_on_change"}};
constexpr std::array eventgroup_names{Name{"eventgroup"}, Name{"events"}, Name{"is_multicast"},
                                      Name{"multicast"}, Name{"threshold"}};
constexpr std::array multicast_names{Name{"address"}, Name{"port"}};
constexpr std::array tp_names{Name{"client-to-service"}, Name{"service-to-client"}};
constexpr std::array tp_method_names{Name{"max-segment-length"}, Name{"method"}, Name{"separation-time"}};
constexpr std::array debounce_names{Name{"requests"}, Name{"responses"}};
constexpr std::array debounce_method_names{Name{"debounce-time"}, Name{"maximum-retention-time"}};
constexpr std::array client_names{
    Name{"instance"}, Name{"reliable"},   Name{"reliable_client_ports"},   Name{"reliable_remote_ports"},
    Name{"service"},  Name{"unreliable"}, Name{"unreliable_client_ports"}, Name{"unreliable_remote_ports"}};
constexpr std::array e2e_names{Name{"e2e_enabled"}, Name{"protected"}};
constexpr std::array protection_names{
    Name{"counter_offset"},
    Name{"crc_offset"},
    Name{"data_id"},
    Name{"data_id_mode"},
    Name{"data_id_nibble_offset"},
    Name{"data_length"},
    Name{"event_id"},
    Name{"max_data_length"},
    Name{"max_delta_counter"},
    Name{"min_data_length"},
    Name{"profile"},
    Name{"service_id"},
    Name{"variant"},
};

}  // namespace

const VsomeipKeys root{"a vsomeip configuration", root_names};
const VsomeipKeys discovery{"the settings of service discovery", discovery_names};
const VsomeipKeys npdu_defaults{"the times of nPDUs", npdu_names};
const VsomeipKeys group_of_services{"a group of services", group_names};
const VsomeipKeys delays{"the delays of a group of services", delay_names};
const VsomeipKeys initial_delays{"the initial delays of a group of services", initial_delay_names};
const VsomeipKeys service{"a service", service_names};
const VsomeipKeys port{"a port", port_names};
const VsomeipKeys event{"an event", event_names};
const VsomeipKeys eventgroup{"an eventgroup", eventgroup_names};
const VsomeipKeys multicast{"a multicast group", multicast_names};
const VsomeipKeys tp{"the settings of SOME/IP-TP", tp_names};
const VsomeipKeys tp_of_method{"the segments of a method or event", tp_method_names};
const VsomeipKeys debounce{"the times of nPDUs of a service", debounce_names};
const VsomeipKeys debounce_of_method{"the times of a method or event", debounce_method_names};
const VsomeipKeys client{"a client", client_names};
const VsomeipKeys e2e{"the settings of E2E", e2e_names};
const VsomeipKeys protection{"what is protected", protection_names};

}  // namespace trestle::describe::vsomeip_keys
