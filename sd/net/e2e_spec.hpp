#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "someip/core/e2e/checker.hpp"
#include "someip/core/e2e/config.hpp"
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// End-to-end protection of an event or a method; a field's notifier is an event, its getter and setter are
/// methods. The same at both ends, but that `protect` here is `check` there.  [feat_req_someip_102]
///
///     server: .e2e = {{.id = speed, .protect = e2e::Profile4{.data_id = 0x2d}}}
///     client: .e2e = {{.id = speed, .check = e2e::Profile4{.data_id = 0x2d}}}
///
/// Applications give and get payloads without the E2E header. The profile's lengths, data_bits and so on,
/// count all: the 8 bytes of the SOME/IP header from the Request ID on, the E2E header, the payload.
///
/// A message whose check says anything but CheckStatus::ok or ok_some_lost is counted and not handed over: an
/// event is dropped, a request answered with E_E2E_REPEATED, E_E2E_WRONG_SEQUENCE or E_E2E, and the caller
/// told the same of an answer (CallFault::error). Handlers that want more than that read Message::check,
/// where the state of the whole communication is, too.
struct E2eSpec {
  someip::MethodId id{};
  /// For what is sent: a server's events or the responses of the method, a client's requests.
  std::optional<someip::e2e::Config> protect{};
  std::optional<someip::e2e::Config> check{};  ///< what is received
  someip::e2e::StateMachineConfig state_machine{};
  /// Hand over also what failed: the handler must look at Message::check. Not for getters and setters of the
  /// server. The payload is empty if it is too short for the E2E header.
  bool pass_failed = false;
  /// Profiles 4m, 7m, 8m, 44m: names the client that calls. A server answers with the source ID of the
  /// request.
  std::uint32_t source_id = 0;
  /// The SOME/IP header is not protected, and positions count from the payload: as vsomeip's profile 1.
  bool payload_only = false;
  /// How many senders' states are kept, 1 at least. With more, the one heard longest ago is forgotten.
  std::size_t max_peers = 64;
  friend bool operator==(const E2eSpec&, const E2eSpec&) = default;
};

}  // namespace trestle::sd
