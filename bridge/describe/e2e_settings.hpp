#pragma once
#include <cstdint>

#include "someip/core/e2e/config.hpp"
#include "someip/core/e2e/state_machine.hpp"

namespace trestle::describe {

/// Of an event, or of a method's requests and answers. Positions count from the Request ID, or from the
/// payload if that is all that is protected.  [feat_req_someip_102]
struct E2eSettings {
  someip::e2e::Config profile{};
  someip::e2e::StateMachineConfig state_machine{};  ///< of what is received
  bool payload_only = false;    ///< the SOME/IP header is left out, as vsomeip does with profile 1
  bool pass_failed = false;     ///< what is received and fails the check is carried nevertheless
  std::uint32_t source_id = 0;  ///< profiles 4m, 7m, 8m, 44m: names who calls
  friend bool operator==(const E2eSettings&, const E2eSettings&) = default;
};

}  // namespace trestle::describe
