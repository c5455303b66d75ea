// bridge/conform: does a device do what SOME/IP asks of it?
//
//   case.hpp       a case as data; the cases are in bridge/conform/cases
//   trial.hpp      what a case is given: sends, waits, judges
//   stimulus.hpp   what is sent, as bytes, right or wrong on purpose
//   tester.hpp     sockets of our own; packet.hpp, capture_writer.hpp: the evidence
//   profile.hpp    what is known of the device; device.hpp: starts and stops it
//   restart_signs.hpp  how its messages show that somebody else restarted it
//   protection.hpp end-to-end protection, from AUTOSAR's specification
//   verdict.hpp    what becomes of a case; runner.hpp: runs cases; parallel.hpp: several devices at once;
//                  selftest.hpp: runs them against faults
//   report.hpp     results as text, JUnit XML and JSON; report_page.hpp: as a page for browsers
//   packet_text.hpp     packets in short
//   results_file.hpp, compare_runs.hpp  JSON results read again, and compared
//   catalogue.hpp  requirements and TC8 cases
//
// The tester does not trust our stack: it uses the codecs (someip/wire, sd/wire), and no state machine of
// ours.
#pragma once
#include <chrono>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/conform/catalogue.hpp"

namespace trestle::conform {

class Trial;
struct Profile;

/// How binding a case is.
enum class Level : std::uint8_t {
  must,    ///< the specification demands it
  should,  ///< the specification advises it
  tc8,     ///< only TC8 asks for it
};
enum class Role : std::uint8_t { server, client };

/// What a device needs so that a case makes sense. Bits.
enum class Need : std::uint32_t {
  nothing = 0,
  udp = 1U << 0U,               ///< the service is offered over UDP
  tcp = 1U << 1U,               ///< the service is offered over TCP
  eventgroup = 1U << 2U,        ///< it has an eventgroup
  initial_values = 1U << 3U,    ///< one with fields
  multicast_events = 1U << 4U,  ///< one whose events go to a multicast group
  request = 1U << 5U,           ///< a method that answers
  fire_and_forget = 1U << 6U,
  field = 1U << 7U,
  restart = 1U << 8U,
  two_services = 1U << 9U,
  two_instances = 1U << 10U,
  cyclic_offers = 1U << 11U,
  repetitions = 1U << 12U,
  ets = 1U << 13U,
  large_request = 1U << 14U,  ///< a method that takes requests in segments
  tcp_eventgroup = 1U << 15U,
  stop = 1U << 16U,                 ///< the device can be stopped, not just restarted
  multicast_threshold = 1U << 17U,  ///< an eventgroup that goes from unicast to multicast
  load_balancing = 1U << 18U,       ///< a service whose offers say how it is to be chosen
  configuration = 1U << 19U,        ///< a service whose offers have configuration items
  two_versions = 1U << 20U,         ///< two major versions of one instance
  e2e = 1U << 21U,                  ///< methods with end-to-end protection
  client = 1U << 22U,               ///< the device uses a service by itself
  ets_client = 1U << 23U,           ///< it uses one when the Enhanced Testability Service says so
  event = 1U << 24U,                ///< an event that can be waited for
  large_message = 1U << 25U,        ///< a response or an event that comes in segments
  tcp_event = 1U << 26U,            ///< an event over TCP that can be waited for
  e2e_event = 1U << 27U,            ///< events with end-to-end protection
};
[[nodiscard]] constexpr Need operator|(Need a, Need b) noexcept {
  return static_cast<Need>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}
[[nodiscard]] constexpr bool has(Need set, Need one) noexcept {
  return (static_cast<std::uint32_t>(set) & static_cast<std::uint32_t>(one)) != 0;
}

/// One thing that a device has to do.
struct Case {
  std::string id;  ///< "sd.subscribe.ack.ttl": stable, people keep lists of them
  std::string
      title;  ///< what the device does when all is well: "acknowledges with the TTL that was asked for"
  Level level = Level::must;
  std::vector<RequirementId> requirements{};
  std::vector<Tc8Id> tc8{};
  Need needs = Need::nothing;
  std::chrono::milliseconds budget = std::chrono::seconds{10};  ///< longer tells nothing of the device
  Role role = Role::server;
  std::function<void(Trial& trial)> run{};
};

[[nodiscard]] const char* to_string(Level level) noexcept;
[[nodiscard]] const char* to_string(Role role) noexcept;

/// The reasons for which a device does not have what is needed, one for each need.
[[nodiscard]] std::vector<std::string> reasons_of(Need needs);
/// Why a case makes no sense for this device; nothing: it does.
[[nodiscard]] std::optional<std::string> unsupported(const Case& one, const Profile& profile);

/// Whether a selector chooses the case: its id, the start of it up to a dot, a pattern with '*', a TC8 id, or
/// the id of a requirement.
[[nodiscard]] bool chosen(const Case& one, std::string_view selector);
/// Those that any of them chooses; all, when there are none.
[[nodiscard]] std::vector<const Case*> choose(const std::vector<Case>& cases,
                                              const std::vector<std::string>& selectors, Level level);

}  // namespace trestle::conform
