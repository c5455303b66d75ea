#include "bridge/inspect/decode/sd_json.hpp"

#include <fmt/format.h>

#include <string_view>

#include "bridge/inspect/decode/names_json.hpp"
#include "sd/wire/message.hpp"
#include "sd/wire/offer_options.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

using sd::Entry;
using sd::EntryType;
using sd::Option;
using sd::OptionType;
using someip::WireError;

Json flags_json(std::uint8_t flags) {
  Json object;
  object["value"] = flags;
  object["reboot"] = (flags & sd::reboot_flag) != 0;
  object["unicast"] = (flags & sd::unicast_flag) != 0;
  object["explicit_initial_data"] = (flags & sd::explicit_initial_data_flag) != 0;
  return object;
}

Json run_json(const sd::OptionRun& run) {
  Json object;
  object["index"] = run.index;
  object["count"] = run.count;
  return object;
}

Json entry_json(const Entry& entry, const describe::Interfaces* interfaces) {
  Json object;
  object["type"] = entry.kind() == sd::EntryKind::unknown ? Json(nullptr) : Json(to_string(entry.kind()));
  object["type_value"] = static_cast<std::uint8_t>(entry.type);
  object["service"] = hex_id(value(entry.service));
  const bool is_named = interfaces != nullptr && interfaces->service(entry.service) != nullptr;
  if (is_named) {
    object["service_name"] = interfaces->name_of(entry.service, entry.major);
  }
  object["instance"] = hex_id(value(entry.instance));
  object["major_version"] = entry.major;
  object["ttl"] = entry.ttl_s;
  if (entry.type == EntryType::subscribe_eventgroup || entry.type == EntryType::subscribe_eventgroup_ack) {
    object["eventgroup"] = hex_id(value(entry.eventgroup()));
    add_eventgroup_name(object, interfaces, entry.service, entry.eventgroup());
    object["counter"] = entry.counter();
    object["initial_data_requested"] = entry.initial_data_requested();
  } else {
    object["minor_version"] = entry.minor();
  }
  object["first_run"] = run_json(entry.first_run);
  object["second_run"] = run_json(entry.second_run);
  return object;
}

Json item_json(const sd::ConfigurationItem& item) {
  Json object;
  object["key"] = std::string{item.key};
  object["value"] = item.value ? Json(std::string{*item.value}) : Json(nullptr);
  return object;
}

Json transport_name(Transport transport) {
  switch (transport) {
    case Transport::tcp:
      return "tcp";
    case Transport::udp:
      return "udp";
  }
  return nullptr;
}

void add_fields(Json& object, const sd::LoadBalancingOption& option) {
  object["priority"] = option.priority;
  object["weight"] = option.weight;
}

void add_fields(Json& object, const sd::MacGroupcastOption& option) {
  object["address"] = fmt::format("{:02x}", fmt::join(option.address, ":"));
  object["protocol"] = hex_id(option.protocol);
  object["identifier"] =
      hex_digits(std::as_bytes(std::span{option.identifier}.first(option.identifier_bytes)));
}

/// Adds the content of the option if it is an option of an offer.
bool add_offer_option(Json& object, const Option& option) {
  bool is_one = false;
  sd::for_each_offer_option([&]<typename Kind>() {
    if (const auto decoded = Kind::decode(option)) {
      add_fields(object, *decoded);
      is_one = true;
    }
  });
  return is_one;
}

Json option_json(const Option& option) {
  Json object;
  object["type"] = is_known(option.type) ? Json(to_string(option.type)) : Json(nullptr);
  object["type_value"] = static_cast<std::uint8_t>(option.type);
  object["length"] = option.body.size();
  object["discardable"] = option.discardable();
  if (const auto endpoint = sd::EndpointOption::decode(option)) {
    object["address"] = someip::to_string(endpoint->endpoint.address);
    object["transport"] = transport_name(endpoint->transport);
    object["transport_value"] = static_cast<std::uint8_t>(endpoint->transport);
    object["port"] = endpoint->endpoint.port;
  } else if (option.type == OptionType::configuration) {
    Json& items = object["items"] = Json::array();
    for (sd::ConfigurationCursor cursor{option}; const auto item = cursor.next();) {
      items.push_back(item_json(*item));
    }
  } else if (!add_offer_option(object, option)) {
    object["body"] = hex_digits(option.body);
  }
  return object;
}

/// The rule behind a fault that the SD codec found, and what to tell a person.
traffic::Violation explain(const sd::WireFault& fault, std::size_t payload_offset) {
  struct Explanation {
    const char* rule;
    const char* detail;
  };
  const auto explanation = [&]() -> Explanation {
    switch (fault.error) {
      case WireError::truncated:
        return {"feat_req_someipsd_1164", "the message ends before the length of its options array"};
      case WireError::bad_entries_length:
        return {"feat_req_someipsd_44",
                "the entries array's length is no multiple of 16 or beyond the message"};
      case WireError::bad_options_length:
        return {"feat_req_someipsd_44", "the options array's length is beyond the message"};
      case WireError::bad_option_length:
        return {"feat_req_someipsd_133", "the option's length does not fit its type, contents or array"};
      case WireError::bad_entry_type:
        return {"feat_req_someipsd_46", "no entry has this type"};
      case WireError::bad_option_reference:
        return {"feat_req_someipsd_102", "the entry references an option that is not there"};
      case WireError::bad_value:
        return {"feat_req_someipsd_102", "the option's address, port, protocol or key is not a valid one"};
      case WireError::not_sd:
        return {"feat_req_someipsd_26", "the Message ID is that of SD, but versions or message type are not"};
      default:
        return {"", ""};
    }
  }();
  return {to_string(fault.error), explanation.rule, payload_offset + fault.offset, explanation.detail};
}

}  // namespace

bool has_sd_id(const someip::Header& header) noexcept {
  const someip::Header expected = sd::sd_header(header.session);
  return header.service == expected.service && header.method == expected.method;
}

std::optional<traffic::Violation> add_sd(Json& object, std::size_t offset, const someip::Message& message,
                                         const std::function<void(Transport, const Endpoint&)>& announced,
                                         const describe::Interfaces* interfaces) {
  const tl::expected<sd::SdMessage, sd::WireFault> decoded = sd::decode(message);
  if (!decoded) {
    if (decoded.error().error == WireError::not_sd) {
      return explain(decoded.error(), offset);
    }
    if (!message.payload.empty()) {
      object["sd"]["flags"] = flags_json(std::to_integer<std::uint8_t>(message.payload[0]));
    }
    return explain(decoded.error(), offset + someip::header_bytes);
  }
  Json& fields = object["sd"];
  fields["flags"] = flags_json(decoded->flags());
  fields["reserved"] = decoded->reserved();
  Json& entries = fields["entries"] = Json::array();
  for (std::size_t i = 0; i < decoded->entry_count(); ++i) {
    entries.push_back(entry_json(decoded->entry(i), interfaces));
  }
  Json& options = fields["options"] = Json::array();
  sd::OptionCursor cursor = decoded->options();
  while (const auto option = cursor.next()) {
    options.push_back(option_json(*option));
    const auto endpoint = sd::EndpointOption::decode(*option);
    if (announced && endpoint && endpoint->role != sd::EndpointRole::sd) {
      announced(endpoint->transport, endpoint->endpoint);
    }
  }
  if (!decoded->trailing().empty()) {
    fields["trailing"] = hex_digits(decoded->trailing());
  }
  if (const auto fault = sd::find_fault(*decoded)) {
    return explain(*fault, offset + someip::header_bytes);
  }
  return std::nullopt;
}

}  // namespace trestle::inspect
