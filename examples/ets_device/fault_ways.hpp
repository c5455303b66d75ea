#pragma once
#include "faults.hpp"

/// What the table of faults is written with: what is in a message, and ways to change it. Numbers are in
/// network byte order, and places count from the first byte of the message or entry.
namespace ets {

// --- Numbers in messages ----------------------------------------------------------------------------------

[[nodiscard]] unsigned u16(std::span<const std::uint8_t> bytes, std::size_t at);
[[nodiscard]] unsigned u32(std::span<const std::uint8_t> bytes, std::size_t at);
void set16(Span bytes, std::size_t at, unsigned number);
void set32(Span bytes, std::size_t at, unsigned number);
void set24(Span bytes, std::size_t at, unsigned number);
[[nodiscard]] unsigned u24(std::span<const std::uint8_t> bytes, std::size_t at);
void add8(Span bytes, std::size_t at, unsigned more = 1);
void add16(Span bytes, std::size_t at, unsigned more = 1);

// --- What is in a message ---------------------------------------------------------------------------------

inline constexpr std::size_t flags_at = 16;    ///< of an SD message
inline constexpr std::size_t entries_at = 24;  ///< the first entry of an SD message

[[nodiscard]] bool is_sd(std::span<const std::uint8_t> bytes);
/// None of SD.
[[nodiscard]] bool is_message(std::span<const std::uint8_t> bytes);
/// Good or an error; also a segment of one.
[[nodiscard]] bool is_response(std::span<const std::uint8_t> bytes);
[[nodiscard]] bool is_event(std::span<const std::uint8_t> bytes);
/// The first option of an SD message.
[[nodiscard]] std::size_t options_at(std::span<const std::uint8_t> bytes);

/// Of an endpoint over IPv4 or IPv6: its type as that of IPv4, 0x04, 0x14 or 0x24; of another option: its
/// type.
[[nodiscard]] unsigned type_of(std::span<const std::uint8_t> option);
/// Places in an endpoint option, which ends with them whatever address it has.
[[nodiscard]] inline std::size_t port_in(std::span<const std::uint8_t> option) {
  return option.size() - 2;
}
[[nodiscard]] inline std::size_t protocol_in(std::span<const std::uint8_t> option) {
  return option.size() - 3;
}
[[nodiscard]] inline std::size_t reserved_in(std::span<const std::uint8_t> option) {
  return option.size() - 4;
}
[[nodiscard]] inline std::size_t end_of_address_in(std::span<const std::uint8_t> option) {
  return option.size() - 5;
}
[[nodiscard]] Receiver receiver_in(std::span<const std::uint8_t> option);

using EntryDo = std::function<void(Span entry)>;
/// The options of an SD message, from the first one on, as long as they are whole.
void each_option(Span sd_message, const EntryDo& look);
using EntryIs = bool (*)(std::span<const std::uint8_t> entry);

/// Of an entry, also by its TTL.
[[nodiscard]] bool is_offer(std::span<const std::uint8_t> entry);
[[nodiscard]] bool is_stop_offer(std::span<const std::uint8_t> entry);
[[nodiscard]] bool is_ack(std::span<const std::uint8_t> entry);
[[nodiscard]] bool is_nack(std::span<const std::uint8_t> entry);
[[nodiscard]] bool is_find(std::span<const std::uint8_t> entry);
[[nodiscard]] bool is_subscribe(std::span<const std::uint8_t> entry);
[[nodiscard]] bool is_stop_subscribe(std::span<const std::uint8_t> entry);
/// Whether it is an SD message with such an entry.
[[nodiscard]] bool any_entry(Span bytes, EntryIs wanted);

// --- Ways to make a fault ---------------------------------------------------------------------------------

/// In each SD message.
[[nodiscard]] Out sd(std::function<void(Span)> change);
/// In each such entry.
[[nodiscard]] Out entry(EntryIs wanted, EntryDo change);
/// In each option of such a type. With its Length and Type fields. The type of an endpoint over IPv4 stands
/// for that over IPv6, too.
[[nodiscard]] Out option(std::uint8_t type, EntryDo change);
/// The message gets lost that has such an entry.
[[nodiscard]] Out lose(EntryIs wanted);
/// In each response, good or an error.
[[nodiscard]] Out response(std::function<void(Bytes&)> change);
/// In each response with a return code.
[[nodiscard]] Out error(std::function<void(Bytes&)> change);
/// In each response without one.
[[nodiscard]] Out good(std::function<void(Bytes&)> change);
/// In each event.
[[nodiscard]] Out event(std::function<void(Outgoing&)> change);
/// Zeros behind the payload of a message, which its Length counts.
void add_payload(Bytes& bytes, std::size_t count);

/// An acknowledgement of whatever begins at an entry's place like a Subscribe.
[[nodiscard]] Bytes acknowledgement(Span sd_message, unsigned ttl_s);
/// In each SD message that begins with a Subscribe or its end, whatever else is wrong with it.
[[nodiscard]] In subscribe_message(std::function<void(Incoming&)> change);
/// Acknowledges such a Subscribe at once.
[[nodiscard]] In acknowledge_if(std::function<bool(Span)> wanted);
/// In each SD message that begins with a Find.
[[nodiscard]] In find_message(std::function<void(Incoming&)> change);

/// What answers a request, without looking at it.
[[nodiscard]] Bytes answer(Span request, unsigned type, unsigned code);
/// Answers such messages at once.
[[nodiscard]] In answer_if(bool (*wanted)(Span), unsigned type, unsigned code);

/// Whether it is of a method with end-to-end protection, and has a payload.
[[nodiscard]] bool is_protected(std::span<const std::uint8_t> message);

/// Puts one more entry into an SD message: a Find or a Subscribe that nobody needs.
void add_entry(Bytes& bytes, std::uint8_t type, unsigned service_used);
/// The same with each message that has an offer.
[[nodiscard]] Out each_offer_has(std::uint8_t type, unsigned service_used);

// --- The table --------------------------------------------------------------------------------------------

/// Of service discovery, also of the device as a client.
[[nodiscard]] std::vector<Fault> sd_faults();
/// Of requests, responses and events, over UDP and TCP.
[[nodiscard]] std::vector<Fault> message_faults();
/// Of many messages, subscribers or connections. To find them takes long.
[[nodiscard]] std::vector<Fault> load_faults();
/// Bugs as they are in parsers and tables, for `trestle fuzz`: what finds them is a kind of finding, no case.
[[nodiscard]] std::vector<Fault> planted_bugs();

}  // namespace ets
