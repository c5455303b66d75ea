#include <fmt/format.h>

#include <algorithm>

#include "bridge/conform/replay/replay.hpp"
#include "someip/net/address_text.hpp"

/// What is in options, and which of them go together.
namespace trestle::conform {
namespace {

using sd::OptionType;
using someip::WireError;

std::size_t count_of_otherserv(const sd::Option& option) {
  std::size_t count = 0;
  sd::ConfigurationCursor items{option};
  while (const auto item = items.next()) {
    count += item->key == "otherserv" && item->value && !item->value->empty() ? 1U : 0U;
  }
  return count;
}

bool refers_to(const sd::OptionRun& run, std::size_t index) {
  return run.count > 0 && index >= run.index && index < std::size_t{run.index} + run.count;
}

}  // namespace

void Replay::judge_layout(const At& at, const sd::Option& option) {
  constexpr auto reserved = std::byte{0x7f};  // the top bit says that the option may be passed over
  const bool reserved_is_0 = !option.body.empty() && (option.body.front() & reserved) == std::byte{0};
  if (option.type == OptionType::configuration) {
    sd::ConfigurationCursor items{option};
    while (items.next()) {
    }
    check(Rule::sd_configuration, at, !items.error() && reserved_is_0, "configuration option",
          "reserved byte 0, items with keys, and a 0 at the end",
          items.error() ? fmt::format("{} at byte {}", someip::to_string(*items.error()), items.offset())
                        : "a reserved byte that is not 0");
  } else if (option.type == OptionType::load_balancing) {
    check(Rule::sd_load_balancing, at, sd::LoadBalancingOption::decode(option) && reserved_is_0,
          "load balancing option", "5 bytes, the first of them 0",
          fmt::format("{} bytes", option.body.size()));
  } else if (option.type == OptionType::mac_groupcast) {
    const auto decoded = sd::MacGroupcastOption::decode(option);
    check(Rule::sd_mac_groupcast, at,
          reserved_is_0 && (decoded || decoded.error() != WireError::bad_option_length),
          "MAC groupcast option", "9 bytes or more, the first of them 0",
          fmt::format("{} bytes", option.body.size()));
  }
}

void Replay::judge_sd_endpoint(const At& at, const sd::SdMessage& message) {
  std::size_t count = 0;
  std::size_t index = 0;
  for (sd::OptionCursor cursor = message.options(); const auto option = cursor.next(); ++index) {
    const auto endpoint = sd::EndpointOption::decode(*option);
    if (!endpoint || endpoint->role != sd::EndpointRole::sd) {
      continue;
    }
    ++count;
    std::string wrong;
    if (count > 1) {
      wrong = "a second one";
    } else if (index != 0) {
      wrong = "behind another option";
    } else if (endpoint->endpoint.address.v6 != at.place.flow.from.address.v6) {
      wrong = "of the other IP version";
    }
    for (std::size_t entry = 0; entry < message.entry_count(); ++entry) {
      const sd::Entry one = message.entry(entry);
      if (refers_to(one.first_run, index) || refers_to(one.second_run, index)) {
        wrong = "one that an entry refers to";
      }
    }
    check(Rule::sd_sd_endpoint, at, wrong.empty(), "SD endpoint option",
          "one, the first option, of the IP version in use, referred to by no entry", wrong);
  }
}

void Replay::judge_other_protocol(const At& at, const sd::SdMessage& message, const sd::Entry& entry) {
  std::size_t items = 0;
  bool has_groupcast = false;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    const auto option = message.option_of(entry, position);
    if (!option) {
      return;  // which is another rule
    }
    has_groupcast = has_groupcast || option->type == OptionType::mac_groupcast;
    items += option->type == OptionType::configuration ? count_of_otherserv(*option) : 0;
  }
  const bool is_other = value(entry.service) == 0xfffe;
  if (is_other || items > 0) {
    check(Rule::sd_otherserv, at, items == (is_other ? 1U : 0U), "otherserv items of the entry",
          is_other ? "1" : "0, for a service of SOME/IP", std::to_string(items));
  }
  if (has_groupcast) {
    check(Rule::sd_mac_groupcast, at, items > 0, "otherserv items beside a MAC groupcast option", "1", "0");
  }
}

}  // namespace trestle::conform
