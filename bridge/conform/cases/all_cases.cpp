#include "bridge/conform/cases/all_cases.hpp"

namespace trestle::conform {

const std::vector<Case>& all_cases() {
  static const Cases all = [] {
    Cases cases;
    for (const auto add : {add_sd_message_cases, add_sd_find_cases, add_sd_subscribe_cases,
                           add_sd_malformed_cases, add_sd_option_cases, add_sd_phase_cases, add_rpc_cases,
                           add_event_cases, add_tcp_cases, add_tp_cases, add_client_cases,
                           add_ets_client_cases, add_e2e_cases, add_load_cases, add_ets_echo_cases}) {
      add(cases);
    }
    return cases;
  }();
  return all;
}

}  // namespace trestle::conform
