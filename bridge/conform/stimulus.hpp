#pragma once
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <vector>

#include "sd/wire/message.hpp"
#include "someip/wire/endpoint.hpp"

/// What the tester sends, as bytes. Everything in a message can be wrong on purpose: what is left out is
/// right.
namespace trestle::conform {

using Bytes = std::vector<std::byte>;

/// Bytes from numbers: bytes({0x00, 0x2a}).
[[nodiscard]] Bytes bytes(std::initializer_list<unsigned> numbers);
/// A number in network order, appended.
void append_u8(Bytes& to, std::uint8_t number);
void append_u16(Bytes& to, std::uint16_t number);
void append_u32(Bytes& to, std::uint32_t number);
void append(Bytes& to, ByteView more);

/// An option with its Length and Type fields.
[[nodiscard]] Bytes endpoint_option(const Endpoint& endpoint, Transport transport);
[[nodiscard]] Bytes raw_option(std::uint16_t length, std::uint8_t type, ByteView body);

/// A message of service discovery.
struct SdStimulus {
  std::vector<sd::Entry> entries{};
  std::vector<Bytes> options{};
  std::uint8_t flags =
      sd::unicast_flag | sd::explicit_initial_data_flag;  ///< the sender adds the reboot flag
  std::uint32_t reserved = 0;
  someip::MethodId method{0x8100};
  std::optional<std::uint32_t> length{};          ///< of the SOME/IP header
  std::optional<std::uint32_t> entries_length{};  ///< as it stands there, whatever follows
  std::optional<std::uint32_t> options_length{};
  Bytes counted_tail{};    ///< after the options array, within Length
  Bytes uncounted_tail{};  ///< after the message

  [[nodiscard]] Bytes encode(someip::SessionId session, bool reboot) const;
};

/// A request or another message of a service.
struct Call {
  someip::ServiceId service{};
  someip::MethodId method{};
  Bytes payload{};
  std::uint8_t interface_version = 1;
  std::uint8_t protocol = someip::protocol_version;
  someip::MessageType type = someip::MessageType::request;
  someip::ReturnCode code = someip::ReturnCode::ok;
  someip::ClientId client{0x5a01};
  someip::SessionId session{};            ///< 0: the tester counts
  std::optional<std::uint32_t> length{};  ///< as it stands there
  Transport transport = Transport::udp;

  [[nodiscard]] Bytes encode() const;
};

}  // namespace trestle::conform
