#include "bridge/decode/message_decoder.hpp"

#include <fmt/format.h>

#include "bridge/decode/sd_json.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::bridge {
namespace {

using someip::WireError;

/// Names the broken rule behind an error of someip::decode().
Violation explain(WireError error, std::size_t offset, ByteView bytes, std::size_t missing) {
  const std::string cut = missing == 0 ? "" : fmt::format("; the recorder cut off {} bytes", missing);
  if (bytes.size() < someip::header_bytes) {
    return {
        to_string(error), "feat_req_someip_45", offset + bytes.size(),
        fmt::format("{} bytes are too few for the header of {}{}", bytes.size(), someip::header_bytes, cut)};
  }
  const auto length = someip::load<std::uint32_t>(bytes.data() + 4);
  if (error == WireError::bad_length) {
    return {to_string(error), "feat_req_someip_798", offset + 4,
            fmt::format("Length {} is below the 8 header bytes that it counts", length)};
  }
  return {to_string(error), "feat_req_someip_77", offset + 4,
          fmt::format("Length {} reaches beyond the {} bytes that follow it{}", length,
                      bytes.size() - someip::length_covered_header_bytes, cut)};
}

/// Adds "tp" to the object of a segment.
std::optional<Violation> add_segment(Json& object, std::size_t offset, const someip::Message& message) {
  if (message.payload.size() >= someip::tp_header_bytes) {
    add_tp(object, someip::to_tp_header(someip::load<std::uint32_t>(message.payload.data())));
  }
  const someip::Result<someip::TpView> segment = someip::decode_tp(message);
  if (segment) {
    return std::nullopt;
  }
  const std::size_t payload_offset = offset + someip::header_bytes;
  if (segment.error() == WireError::bad_tp_offset) {
    return Violation{to_string(segment.error()), "feat_req_someiptp_772", payload_offset,
                     fmt::format("{} bytes are no multiple of 16, yet more segments are to follow",
                                 message.payload.size() - someip::tp_header_bytes)};
  }
  return Violation{to_string(segment.error()), "feat_req_someiptp_766", payload_offset,
                   fmt::format("{} bytes are too few for the TP header of 4", message.payload.size())};
}

}  // namespace

MessageDecoder::MessageDecoder(bool reassemble, Hooks hooks) : hooks_{std::move(hooks)} {
  if (reassemble) {
    assembly_.emplace();
  }
}

bool MessageDecoder::datagram(const Place& place, ByteView bytes) {
  someip::MessageCursor cursor{bytes};
  bool well_formed = true;
  for (std::size_t offset = 0; const auto found = cursor.next(); offset = cursor.offset()) {
    well_formed = message(place, offset, *found) && well_formed;
  }
  if (cursor.error()) {
    undecodable(place, cursor.offset(), bytes.subspan(cursor.offset()), *cursor.error());
  }
  return well_formed && !cursor.error();
}

bool MessageDecoder::message(const Place& place, std::size_t offset, const someip::Message& message) {
  return print_message(place, offset, message, false);
}

bool MessageDecoder::print_message(const Place& place, std::size_t offset, const someip::Message& message,
                                   bool reassembled) {
  Json object = place.fields;
  object["offset"] = offset;
  add_header(object, message.header, message.payload.size());
  std::optional<Violation> violation;
  ByteView payload = message.payload;
  const bool segment = is_tp(message.header.type);
  if (reassembled) {
    object["reassembled"] = true;
  }
  if (segment) {
    violation = add_segment(object, offset, message);
    payload = payload.subspan(std::min(payload.size(), someip::tp_header_bytes));
  } else if (has_sd_id(message.header)) {
    violation = add_sd(object, offset, message, hooks_.announced);
  } else {
    add_magic_cookie(object, message);
  }
  someip::Result<std::optional<someip::Reassembled>, someip::TpDrop> whole{std::nullopt};
  if (segment && assembly_) {
    whole = assembly_->add(place.flow, message, place.time);
    if (!whole) {
      object["tp"]["dropped"] = to_string(whole.error());
    }
  }
  object["payload"] = hex_digits(payload);
  if (violation) {
    add_error(object, *violation);
    ++malformed_;
  }
  ++messages_;
  hooks_.print(object);
  if (whole && *whole) {
    print_message(place, offset, {(*whole)->header, (*whole)->payload}, true);
  }
  return !violation;
}

void MessageDecoder::undecodable(const Place& place, std::size_t offset, ByteView bytes,
                                 const Violation& violation) {
  Json object = place.fields;
  object["offset"] = offset;
  add_partial_header(object, bytes);
  object["bytes"] = hex_digits(bytes);
  unreadable(std::move(object), violation);
}

void MessageDecoder::unreadable(Json object, const Violation& violation) {
  add_error(object, violation);
  ++malformed_;
  hooks_.print(object);
}

void MessageDecoder::undecodable(const Place& place, std::size_t offset, ByteView bytes, WireError error) {
  undecodable(place, offset, bytes, explain(error, offset, bytes, place.missing));
}

std::uint64_t MessageDecoder::incomplete() const noexcept {
  return assembly_ ? assembly_->incomplete() : 0;
}

}  // namespace trestle::bridge
