#include "bridge/traffic/message_sink.hpp"

#include <fmt/format.h>

#include "someip/wire/bytes.hpp"

namespace trestle::traffic {
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

}  // namespace

bool MessageSink::datagram(const Place& place, ByteView bytes) {
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

void MessageSink::undecodable(const Place& place, std::size_t offset, ByteView bytes, WireError error) {
  undecodable(place, offset, bytes, explain(error, offset, bytes, place.missing));
}

}  // namespace trestle::traffic
