#pragma once
#include <cstddef>
#include <span>
#include <string>

#include "bridge/picture/picture.hpp"

namespace trestle::carry {

/// Why nothing flows on a route. In the order in which they are looked for: where several are true, the first
/// one is what to mend first.
enum class Cause : std::uint8_t {
  none,  ///< it flows; or nothing is amiss, and it waits on purpose
  // From SOME/IP:
  other_interface,
  outside_subnet,
  no_packet,
  not_offered,
  offered_otherwise,  ///< as another instance or version
  refused,
  over_tcp_only,
  not_acknowledged,
  other_events,
  no_event,
  not_callable,  ///< the service is offered, but not so that its methods can be called
  // From DDS:
  no_participant,
  no_publisher,
  other_type,
  refused_type,  ///< `types: strict`
  other_qos,
  no_sample,
  no_ros_server,
  // Of a pattern:
  not_locked,    ///< from SOME/IP: the lock file has no topic for it
  no_match,      ///< to SOME/IP
  only_bridges,  ///< likewise
  no_route,      ///< likewise: what matches is refused
  // Messages come, and are not carried:
  reader_qos,
  no_reader,
  not_published,  ///< the service is not offered, as other topics of it have no publisher
  no_subscriber,
  dropped,  ///< by a fault: the counter with the most says which
};

/// A cause, and what of it is the route's own.
struct Why {
  Cause cause = Cause::none;
  /// Without numbers that change by themselves: with another one the cause is told of again.
  std::string details;
  friend bool operator==(const Why&, const Why&) = default;
};

/// Why nothing flows on the route.
/// @param around  the picture that it is of, of which routes and lists do not matter.
[[nodiscard]] Why why(const RoutePicture& route, const Picture& around);

/// The cause in words, without the name of the route.
/// @param route  nothing: several routes have it, and what is the route's own is left out.
[[nodiscard]] std::string in_words(const Why& why, const RoutePicture* route, const Picture& around);

/// Whether one of the writers of the topic goes with the route's reader, in type and quality of service.
[[nodiscard]] bool has_fitting_writer(const RoutePicture& route);

/// A line of the list of causes: what docs/status.md has, and labels of metrics.
struct CauseRow {
  Cause cause;
  const char* name;     ///< as it stands above
  const char* meaning;  ///< a few words
};
[[nodiscard]] std::span<const CauseRow> cause_rows() noexcept;
[[nodiscard]] const char* to_string(Cause cause) noexcept;

/// Fills in the cause and the state of each route of the picture.
void explain(Picture& picture);

}  // namespace trestle::carry
