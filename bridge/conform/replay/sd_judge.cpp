#include <fmt/format.h>

#include <algorithm>

#include "bridge/conform/replay/replay.hpp"
#include "someip/net/address_text.hpp"

/// Service discovery.
namespace trestle::conform {
namespace {

using sd::EntryKind;
using sd::EntryType;
using someip::WireError;

/// The endpoint options that an entry refers to; `broken`: a run goes beyond the array.
struct Endpoints {
  std::size_t udp = 0;
  std::size_t tcp = 0;
  std::size_t udp6 = 0;
  std::size_t tcp6 = 0;
  std::size_t multicast = 0;
  std::set<IpAddress> addresses{};  ///< of unicast endpoints
  bool broken = false;
  bool other_protocol = false;  ///< of a service that is not SOME/IP: it needs no endpoint

  [[nodiscard]] std::size_t unicast() const { return udp + tcp + udp6 + tcp6; }
};

Endpoints endpoints_of(const sd::SdMessage& message, const sd::Entry& entry) {
  Endpoints all;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    const auto option = message.option_of(entry, position);
    if (!option) {
      all.broken = true;
      continue;
    }
    all.other_protocol = all.other_protocol || option->type == sd::OptionType::configuration ||
                         option->type == sd::OptionType::mac_groupcast;
    const auto endpoint = sd::EndpointOption::decode(*option);
    if (!endpoint) {
      continue;
    }
    if (endpoint->role == sd::EndpointRole::multicast) {
      ++all.multicast;
    } else if (endpoint->role == sd::EndpointRole::unicast) {
      all.addresses.insert(endpoint->endpoint.address);
      const bool v6 = endpoint->endpoint.address.v6;
      if (endpoint->transport == Transport::udp) {
        ++(v6 ? all.udp6 : all.udp);
      } else if (endpoint->transport == Transport::tcp) {
        ++(v6 ? all.tcp6 : all.tcp);
      }
    }
  }
  return all;
}

}  // namespace

void Replay::judge_sd(const At& at) {
  const someip::Header& header = at.message.header;
  const bool fixed = header.interface_version == 1 && header.type == someip::MessageType::notification &&
                     header.return_code == someip::ReturnCode::ok;
  check(Rule::sd_header, at, fixed, "header", "Interface Version 1, Message Type 0x02, Return Code 0x00",
        fmt::format("{}, {:#04x}, {:#04x}", header.interface_version, static_cast<unsigned>(header.type),
                    static_cast<unsigned>(header.return_code)));
  check(Rule::sd_session, at, value(header.session) != 0, "Session ID", "not 0", "0");
  const auto message = sd::decode(at.message.payload);
  check(Rule::sd_arrays, at, message.has_value(), "lengths of the arrays", "as long as what follows",
        message ? "" : someip::to_string(message.error().error));
  if (!message) {
    return;
  }
  judge_sd_session(at, *message);
  check(Rule::sd_entries, at, message->entry_count() > 0, "entries", "1 or more", "none");
  check(Rule::sd_unicast_flag, at, message->unicast(), "Unicast flag", "1", "0");
  constexpr unsigned known = sd::reboot_flag | sd::unicast_flag | sd::explicit_initial_data_flag;
  check(Rule::sd_reserved, at, (message->flags() & ~known) == 0 && message->reserved() == 0, "reserved bits",
        "0", fmt::format("flags {:#04x}, then {:#08x}", message->flags(), message->reserved()));
  check(Rule::sd_initial_data_flag, at, !message->explicit_initial_data(), "flags & 0x3f", "0", "0x20");
  judge_options(at, *message);
  judge_sd_endpoint(at, *message);
  judge_pairs(at, *message);
  for (std::size_t index = 0; index < message->entry_count(); ++index) {
    judge_entry(at, *message, message->entry(index));
  }
}

void Replay::judge_sd_session(const At& at, const sd::SdMessage& message) {
  const std::uint16_t session = value(at.message.header.session);
  const auto [before, is_new] = sessions_.try_emplace({at.place.flow.from, at.place.flow.to});
  Sessions& last = before->second;
  const Sessions was = last;
  last = {.last = session, .reboot = message.reboot()};
  if (sessions_.size() > most_relations) {
    sessions_.clear();
    return;
  }
  // Nothing is known yet; or the sender does not count, which is another rule; or it is the same packet,
  // recorded twice.
  if (is_new || session == 0 || was.last == 0 || (session == was.last && message.reboot() == was.reboot)) {
    return;
  }
  const bool went_back = session < was.last;
  // Over the end of the numbers, with some packets that are not in the capture.
  const bool wrapped = went_back && was.last > 0xff00 && session < 0x100;
  const bool restarted = message.reboot() && (!was.reboot || went_back) && !wrapped;
  if (restarted) {
    ++reboots_;
    // Its services may be elsewhere now.
    std::erase_if(places_,
                  [&](const auto& one) { return std::get<0>(one.first) == at.place.flow.from.address; });
  }
  check(Rule::sd_session_order, at, !went_back || wrapped || restarted, "Session ID",
        fmt::format("more than {}, or the Reboot flag of a start", was.last), std::to_string(session));
  check(Rule::sd_reboot_flag, at, message.reboot() || !was.reboot || wrapped, "Reboot flag",
        "1 until the Session ID wraps", "0");
}

void Replay::judge_options(const At& at, const sd::SdMessage& message) {
  // A look at each option, also at those that no entry refers to.
  std::vector<sd::Option> seen;
  sd::OptionCursor cursor = message.options();
  while (const auto option = cursor.next()) {
    judge_layout(at, *option);
    if (const auto endpoint = sd::EndpointOption::decode(*option)) {
      const bool udp = endpoint->transport == Transport::udp;
      check(Rule::sd_option_protocol, at,
            udp || (endpoint->transport == Transport::tcp && endpoint->role == sd::EndpointRole::unicast),
            "protocol", endpoint->role == sd::EndpointRole::unicast ? "UDP or TCP" : "UDP",
            fmt::format("{:#04x}", static_cast<unsigned>(endpoint->transport)));
      check(Rule::sd_option_reserved, at, (endpoint->flags & 0x7fU) == 0 && endpoint->reserved == 0,
            "reserved bytes of an option", "0",
            fmt::format("{:#04x} {:#04x}", endpoint->flags, endpoint->reserved));
      if (endpoint->role == sd::EndpointRole::multicast) {
        check(Rule::sd_multicast_address, at,
              endpoint->endpoint.address.is_multicast() && endpoint->endpoint.port != 0,
              "endpoint of a multicast option", "a multicast group, and a port",
              someip::to_string(endpoint->endpoint));
      }
      if (endpoint->role == sd::EndpointRole::unicast) {
        check(Rule::sd_endpoint_port, at, endpoint->endpoint.port != 0, "port of an endpoint option", "not 0",
              "0");
        if (endpoint->endpoint.port != 0) {
          learn_(endpoint->transport, endpoint->endpoint);
        }
      }
    } else if (endpoint.error() == WireError::bad_option_length) {
      check(Rule::sd_option_layout, at, false,
            fmt::format("length of the {} option", sd::to_string(option->type)), "that of its type",
            std::to_string(option->body.size()));
    }
    check(Rule::sd_option_layout, at, sd::is_known(option->type), "type of an option", "one that is defined",
          fmt::format("{:#04x}", static_cast<unsigned>(option->type)));
    check(Rule::sd_option_repeated, at, std::ranges::find(seen, *option) == seen.end(), "options",
          "different ones", "two that are equal");
    seen.push_back(*option);
  }
  if (cursor.error()) {
    check(Rule::sd_option_layout, at, false, "length of an option", "within the options array", "beyond it");
  }
}

void Replay::judge_entry(const At& at, const sd::SdMessage& message, const sd::Entry& entry) {
  const EntryKind kind = entry.kind();
  const Endpoints options = endpoints_of(message, entry);
  const std::string text = entry_text(message, entry);
  check(Rule::sd_entry_type, at, kind != EntryKind::unknown, "type of an entry", "0x00, 0x01, 0x06 or 0x07",
        fmt::format("{:#04x}", static_cast<unsigned>(entry.type)));
  check(Rule::sd_run, at, !options.broken, "option run", "within the options array", "beyond it");
  for (const sd::OptionRun& run : {entry.first_run, entry.second_run}) {
    if (run.count == 0) {
      check(Rule::sd_empty_run, at, run.index == 0, "index of an empty option run", "0",
            std::to_string(run.index));
    }
  }
  if (kind == EntryKind::unknown) {
    return;
  }
  judge_ids(at, entry);
  judge_other_protocol(at, message, entry);
  const bool of_service = entry.type == EntryType::find_service || entry.type == EntryType::offer_service;
  if (!of_service) {
    // 8 bits, then the initial data bit, 3 bits, the counter.
    check(Rule::sd_entry_reserved, at, (entry.tail & 0xff70'0000U) == 0, "reserved bits of the entry", "0",
          fmt::format("{:#06x} before the eventgroup", entry.tail >> 16U));
    check(Rule::sd_unicast_only, at, !at.place.flow.to.address.is_multicast(), "destination", "one host",
          someip::to_string(at.place.flow.to));
  }
  const bool is_other = value(entry.service) == 0xfffe || options.other_protocol;
  const bool one_each = options.udp <= 1 && options.tcp <= 1 && options.udp6 <= 1 && options.tcp6 <= 1;
  const bool is_subscribe = entry.type == EntryType::subscribe_eventgroup;
  bool counts = one_each && options.multicast == 0;
  if (entry.type == EntryType::find_service) {
    counts = options.unicast() == 0 && options.multicast == 0;
  } else if (entry.type == EntryType::subscribe_eventgroup_ack) {
    counts = options.unicast() == 0 && options.multicast <= 1;
  }
  check(Rule::sd_option_counts, at, counts, "endpoint options of the entry", "as many as its type allows",
        text);
  if (kind == EntryKind::offer_service && !is_other && !options.broken) {
    check(Rule::sd_offer_endpoint, at, options.unicast() > 0, "endpoint options of the offer", "1 or more",
          "none");
  }
  if (kind == EntryKind::subscribe_eventgroup && !options.broken) {
    check(Rule::sd_subscribe_endpoint, at, options.unicast() > 0, "endpoint options of the subscription",
          "1 or more", "none");
  }
  if (kind == EntryKind::subscribe_eventgroup && options.unicast() > 0) {
    check(Rule::sd_subscribe_address, at, options.addresses == std::set{at.place.flow.from.address},
          "address of the subscription", "that of its sender", text);
    judge_transports(at, message, entry);
    judge_subscriber(at, message, entry);
  }
  if (is_subscribe || entry.type == EntryType::subscribe_eventgroup_ack) {
    judge_subscription(at, message, entry);
  } else if (entry.type == EntryType::offer_service) {
    judge_offer(at, message, entry);
  }
}

void Replay::judge_ids(const At& at, const sd::Entry& entry) {
  const bool any_allowed = entry.type == EntryType::find_service && entry.instance == someip::any_instance;
  check(Rule::sd_instance_id, at, any_allowed || someip::names_an_instance(entry.instance), "Instance ID",
        "that of an instance", fmt::format("{:#06x}", value(entry.instance)));
  if (entry.type == EntryType::find_service) {
    check(Rule::sd_find_minor, at, entry.minor() == sd::any_minor, "Minor Version", "0xffffffff",
          fmt::format("{:#x}", entry.minor()));
  } else if (entry.type != EntryType::offer_service) {
    check(Rule::sd_eventgroup_id, at, value(entry.eventgroup()) != 0, "Eventgroup ID", "not 0", "0");
  }
}

}  // namespace trestle::conform
