// bridge/guest: tools beside a running bridge, as guests of its SOME/IP address.
//
//   guest.hpp  the tool's end: finds the bridge of this host that has an address
//   host.hpp   the bridge's end: looks for services, calls and subscribes for guests, within bounds;
//              visit.hpp: for one of them
//   frame.hpp  what the two say to each other
//
// One address belongs to one SOME/IP stack. So where a bridge has it, `trestle find`, `call` and `subscribe`
// do what they do through the bridge, by a Unix socket beside that of `trestle status`.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sd/core/events.hpp"
#include "someip/wire/header.hpp"

namespace trestle::guest {

/// No frame is larger, nor is what a guest sends or gets by one call.
inline constexpr std::size_t most_frame_bytes = std::size_t{4} << 20U;
/// Before each frame: its length, in network order.
inline constexpr std::size_t length_bytes = 4;
inline constexpr std::size_t most_events = 256;

// --- Of the bridge ----------------------------------------------------------------------------------------

/// The first frame.
struct Hello {
  std::uint32_t process = 0;
  Endpoint at{};  ///< of its service discovery
  std::string configuration{};
  friend bool operator==(const Hello&, const Hello&) = default;
};

/// A service is offered; its options and handle are left out.
struct Found {
  sd::RemoteService service{};
  friend bool operator==(const Found&, const Found&) = default;
};

/// How a call ended.
struct Answer {
  std::string fault{};     ///< why it failed; empty: it did not
  bool is_answer = false;  ///< `message` is what the server said, which may be an error
  std::vector<std::byte> message{};
  friend bool operator==(const Answer&, const Answer&) = default;
};

struct Event {
  Endpoint from{};
  std::uint64_t lost = 0;  ///< events before it that this guest did not get
  std::vector<std::byte> message{};
  friend bool operator==(const Event&, const Event&) = default;
};

/// A line for people.
struct Said {
  bool is_end = false;  ///< nothing comes after it: what was wanted cannot be
  std::string text{};
  friend bool operator==(const Said&, const Said&) = default;
};

// --- Of the guest -----------------------------------------------------------------------------------------

struct Find {
  someip::ServiceId service{};
  someip::InstanceId instance = someip::any_instance;
  friend bool operator==(const Find&, const Find&) = default;
};

struct Call {
  someip::ServiceId service{};
  someip::InstanceId instance = someip::any_instance;
  std::uint8_t major = 1;
  someip::MethodId method{};
  std::uint32_t timeout_ms = 5000;
  std::optional<Transport> transport{};
  bool forget = false;  ///< without an answer
  std::vector<std::byte> payload{};
  friend bool operator==(const Call&, const Call&) = default;
};

struct Subscribe {
  someip::ServiceId service{};
  someip::InstanceId instance{};  ///< one
  std::uint8_t major = 1;
  someip::EventgroupId eventgroup{};
  bool udp = true;
  bool tcp = false;
  std::vector<someip::MethodId> events{};  ///< none: 0x8001 to 0x8fff; at most most_events
  friend bool operator==(const Subscribe&, const Subscribe&) = default;
};

using Frame = std::variant<Hello, Found, Answer, Event, Said, Find, Call, Subscribe>;

/// With its length.
[[nodiscard]] std::vector<std::byte> encode(const Frame& frame);
/// Appends an Event without a copy of its own.
void append_event(std::vector<std::byte>& to, const someip::Message& message, const Endpoint& from,
                  std::uint64_t lost);
/// @param bytes  without its length, all of it.
/// @return nothing if that is no frame.
[[nodiscard]] std::optional<Frame> decode(ByteView bytes);

}  // namespace trestle::guest
