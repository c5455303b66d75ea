#pragma once
#include <cstdint>
#include <optional>

#include "sd/core/device/description.hpp"

namespace trestle::device {

/// Which argument of a call cannot be, or which member of the description that the call is about. What each
/// must be is said here.
enum class Argument : std::uint8_t {
  none,

  // Of a call.
  service,      ///< a place in Settings::services
  need,         ///< a place in Settings::needs
  field,        ///< a place in Service::fields
  event,        ///< the id of one of Service::events; set_field() is what sends a notifier
  request,      ///< accept(): of a setter of the service
  return_code,  ///< respond_error(): not ok

  // Of a Service or Need.
  service_id,    ///< not 0x0000 and not 0xffff; not 0xfffe either, which says that it is no SOME/IP
  instance,      ///< not 0x0000; and one, so not 0xffff, to offer it or to subscribe
  major,         ///< of an offered service: not 0xff
  port,          ///< not 0, and not the port of discovery
  ttl_s,         ///< from 1 to 16777215; of a need, its subscription `index`
  subscription,  ///< of a need, its subscription `index`: an eventgroup that is one, a silence_timeout above
                 ///< 0
  discovery,     ///< Settings::discovery: a unicast address, and a ttl_s, that can be

  // Of a Service, its member `index`. No id may be that of another member.  [feat_req_someip_625]
  eventgroup,           ///< an id that is not 0x0000 and not 0xffff; its events by UDP unicast alone
  method,               ///< an id, and a kind
  listed_event,         ///< an id
  event_eventgroups,    ///< all of them among Service::eventgroups
  field_getter,         ///< an id, or 0
  field_setter,         ///< an id, or 0
  field_notifier,       ///< an id, or 0
  field_eventgroups,    ///< all of them among Service::eventgroups
  field_initial_bytes,  ///< at most the size of Field::room
};

/// The argument's name as it stands above, for logs.
[[nodiscard]] const char* to_string(Argument argument) noexcept;

/// What was wrong with the call that was refused as bad_argument.
struct BadArgument {
  Argument argument = Argument::none;
  std::uint16_t index = 0;  ///< of the member, in its table

  friend constexpr bool operator==(const BadArgument&, const BadArgument&) = default;
};

/// What in `service` cannot be offered, or none: but for its port.
[[nodiscard]] BadArgument mistake_in(const Service& service) noexcept;
/// What in `need` cannot be looked for, or none: but for its port.
[[nodiscard]] BadArgument mistake_in(const Need& need) noexcept;

/// Number `number` of the ids of `service` that are reserved [feat_req_someipids_636], or in the range that
/// is meant for the other kind [feat_req_someip_626]: methods, getters and setters from 0x8000 on, events and
/// notifiers below. Nothing when there are no more.
[[nodiscard]] std::optional<MethodId> unusual_id(const Service& service, std::size_t number) noexcept;

}  // namespace trestle::device
