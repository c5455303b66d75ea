#include "bridge/inspect/decode/message_decoder.hpp"

#include <fmt/format.h>

#include "bridge/inspect/decode/left_over.hpp"
#include "bridge/inspect/decode/names_json.hpp"
#include "bridge/inspect/decode/sd_json.hpp"
#include "someip/net/address_text.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::inspect {
namespace {

using someip::WireError;

/// "2026-11-21T01:39:25.522395000Z"
std::string timestamp(pcaps::Timestamp time) {
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date{day};
  const std::chrono::hh_mm_ss clock{time - day};
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:09}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                     clock.hours().count(), clock.minutes().count(), clock.seconds().count(),
                     clock.subseconds().count());
}

/// The fields with which each object about these bytes begins.
Json fields_of(const traffic::Place& place) {
  Json fields;
  if (place.line > 0) {
    fields["line"] = place.line;
  }
  if (place.frame > 0) {
    fields["frame"] = place.frame;
    fields["time"] = timestamp(place.time);
  }
  if (place.transport) {
    fields["src"] = someip::to_string(place.flow.from);
    fields["dst"] = someip::to_string(place.flow.to);
    fields["transport"] = *place.transport == Transport::tcp ? "tcp" : "udp";
  }
  return fields;
}

/// Adds "tp" to the object of a segment.
std::optional<traffic::Violation> add_segment(Json& object, std::size_t offset,
                                              const someip::Message& message) {
  if (message.payload.size() >= someip::tp_header_bytes) {
    add_tp(object, someip::to_tp_header(someip::load<std::uint32_t>(message.payload.data())));
  }
  const someip::Result<someip::TpView> segment = someip::decode_tp(message);
  if (segment) {
    return std::nullopt;
  }
  const std::size_t payload_offset = offset + someip::header_bytes;
  if (segment.error() == WireError::bad_tp_offset) {
    return traffic::Violation{to_string(segment.error()), "feat_req_someiptp_772", payload_offset,
                              fmt::format("{} bytes are no multiple of 16, yet more segments are to follow",
                                          message.payload.size() - someip::tp_header_bytes)};
  }
  return traffic::Violation{
      to_string(segment.error()), "feat_req_someiptp_766", payload_offset,
      fmt::format("{} bytes are too few for the TP header of 4", message.payload.size())};
}

}  // namespace

MessageDecoder::MessageDecoder(bool reassemble, Hooks hooks, const describe::Interfaces* interfaces)
    : hooks_{std::move(hooks)}, interfaces_{interfaces} {
  if (reassemble) {
    assembly_.emplace();
  }
}

bool MessageDecoder::message(const traffic::Place& place, std::size_t offset,
                             const someip::Message& message) {
  return print_message(place, offset, message, false);
}

bool MessageDecoder::print_message(const traffic::Place& place, std::size_t offset,
                                   const someip::Message& message, bool reassembled) {
  Json object = fields_of(place);
  object["offset"] = offset;
  add_header(object, message.header, message.payload.size());
  std::optional<traffic::Violation> violation;
  ByteView payload = message.payload;
  const bool segment = is_tp(message.header.type);
  if (reassembled) {
    object["reassembled"] = true;
  }
  if (segment) {
    violation = add_segment(object, offset, message);
    payload = payload.subspan(std::min(payload.size(), someip::tp_header_bytes));
  } else if (has_sd_id(message.header)) {
    violation = add_sd(object, offset, message, hooks_.announced, interfaces_);
  } else {
    add_magic_cookie(object, message);
  }
  if (const auto misfit = add_described(object, offset, message, segment); misfit && !violation) {
    violation = misfit;
  }
  someip::Result<std::optional<someip::Reassembled>, someip::TpDrop> whole{std::nullopt};
  if (segment && assembly_) {
    whole = assembly_->add(place.flow, message, TimePoint{place.time.time_since_epoch()});
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
  note_services(object);
  hooks_.print(object);
  if (whole && *whole) {
    print_message(place, offset, {(*whole)->header, (*whole)->payload}, true);
  }
  return !violation;
}

/// Adds names and values.
/// @return where the payload does not fit its description.
std::optional<traffic::Violation> MessageDecoder::add_described(Json& object, std::size_t offset,
                                                                const someip::Message& message,
                                                                bool is_segment) {
  const someip::Header& header = message.header;
  const describe::Service* const service =
      interfaces_ == nullptr ? nullptr : interfaces_->service(header.service, header.interface_version);
  if (service == nullptr) {
    return std::nullopt;
  }
  const describe::ServiceElement* const element =
      interfaces_->element(header.service, header.interface_version, header.method);
  if (element == nullptr) {
    object["service_name"] = interfaces_->name_of(header.service, header.interface_version);
    return std::nullopt;
  }
  add_names(object, *interfaces_, *element);
  const std::uint8_t major = interfaces_->model().services[element->service].major;
  if (header.interface_version != major) {
    object["described_version"] = major;
    ++with_other_version_;
  }
  const describe::Content* const content = is_segment ? nullptr : content_of(*interfaces_, *element, header);
  if (content == nullptr) {
    return std::nullopt;
  }
  const auto misfit = add_values(object, *content, message.payload);
  if (auto behind = left_over(*interfaces_, *element, *content, message.payload)) {
    behind->offset += offset + someip::header_bytes;
    object["left_over"] = to_json(*behind);
    ++with_left_over_;
  }
  // Of another version the description need not be right.
  if (!misfit || header.interface_version != major) {
    return std::nullopt;
  }
  return traffic::Violation{"bad_values", "", offset + someip::header_bytes + misfit->offset, misfit->detail,
                            misfit->field};
}

void MessageDecoder::undecodable(const traffic::Place& place, std::size_t offset, ByteView bytes,
                                 const traffic::Violation& violation) {
  Json object = fields_of(place);
  object["offset"] = offset;
  add_partial_header(object, bytes);
  object["bytes"] = hex_digits(bytes);
  print_violation(std::move(object), violation);
}

void MessageDecoder::broken_frame(const traffic::Place& place, const traffic::Violation& violation) {
  print_violation(fields_of(place), violation);
}

void MessageDecoder::unreadable(const traffic::Place& place, const traffic::Violation& violation) {
  Json object = fields_of(place);
  object["offset"] = 0;
  print_violation(std::move(object), violation);
}

void MessageDecoder::print_violation(Json object, const traffic::Violation& violation) {
  add_error(object, violation);
  ++malformed_;
  hooks_.print(object);
}

void MessageDecoder::note_services(const Json& object) {
  if (interfaces_ == nullptr || object.contains("magic_cookie")) {
    return;
  }
  const auto note = [this](const Json& of_service) {
    if (of_service.contains("service_name")) {
      saw_described_ = true;
    } else {
      undescribed_.insert(of_service["service"].get<std::string>());
    }
  };
  if (!object.contains("sd")) {
    note(object);
  } else if (object["sd"].contains("entries")) {
    for (const Json& entry : object["sd"]["entries"]) {
      note(entry);
    }
  }
}

std::uint64_t MessageDecoder::incomplete() const noexcept {
  return assembly_ ? assembly_->incomplete() : 0;
}

}  // namespace trestle::inspect
