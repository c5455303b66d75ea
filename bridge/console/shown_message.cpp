#include "bridge/console/shown_message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/raise.hpp"
#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/map/map_compiler.hpp"
#include "bridge/messages/map/mapped_plan.hpp"
#include "bridge/messages/values/message_values.hpp"

namespace trestle::console {
namespace {

constexpr std::size_t longest_array = 64;  // that is printed
constexpr std::size_t most_hex_bytes = 16;

std::string hex_of(ByteView bytes) {
  std::string text;
  for (const std::byte byte : bytes.first(std::min(bytes.size(), most_hex_bytes))) {
    text += fmt::format("{}{:02x}", text.empty() ? "" : " ", static_cast<unsigned>(byte));
  }
  return bytes.size() > most_hex_bytes ? text + " …" : text;
}

const messages::TypeTree& payload_tree(const ShownMessage& shown) {
  return shown.map ? shown.map->payload : shown.tree;
}

/// A message in both forms, by a mapping of fields. It goes in the direction of the route alone.
tl::expected<BothForms, std::string> mapped_forms(const ShownMessage& shown, const ShownMap& map) {
  const carry::SeenMessage& newest = *shown.newest;
  auto wire =
      messages::ConversionPlan::compile(map.payload, shown.rules, std::numeric_limits<std::size_t>::max());
  if (!wire) {
    return tl::unexpected{wire.error()};
  }
  auto fields = messages::compile_map(
      map.payload, shown.tree, map.mapping,
      newest.is_cdr ? messages::MapDirection::to_payload : messages::MapDirection::to_ros);
  if (!fields.map) {
    return tl::unexpected{fields.problems.front().text};
  }
  messages::MappedPlan plan{std::move(*wire), std::move(*fields.map)};
  messages::MappedScratch scratch;
  BothForms result;
  if (!newest.is_cdr) {
    result.payload = newest.bytes;
    const auto sample = plan.someip_to_cdr(newest.bytes, std::chrono::nanoseconds{newest.at_ns}, scratch);
    if (!sample) {
      return tl::unexpected{to_string(sample.error())};
    }
    result.sample = messages::joined(*sample);
    return result;
  }
  const auto payload = plan.cdr_to_someip(newest.bytes, scratch);
  if (!payload) {
    return tl::unexpected{to_string(payload.error())};
  }
  result.payload = messages::joined(*payload);
  // There and back brings what came to the host's byte order.
  ShownMessage unmapped;
  unmapped.tree = shown.tree;
  unmapped.newest = shown.newest;
  auto sample = both_forms(unmapped);
  if (!sample) {
    return tl::unexpected{sample.error()};
  }
  result.sample = std::move(sample->sample);
  return result;
}

void add_layout(nlohmann::json& json, const ShownMessage& shown, ByteView payload) {
  describe::Model model;
  describe::RaisedTypes types{model};
  std::vector<std::string> lost;
  const describe::Payload what = describe::raise(
      types, payload_tree(shown), messages::rules_for(payload_tree(shown), shown.rules), {}, lost);
  const describe::Layout layout = describe::layout(model, what, payload);
  auto& rows = json["layout"] = nlohmann::json::array();
  std::size_t at = 0;
  for (const describe::ByteRange& one : layout.ranges) {
    if (rows.size() == most_shown_ranges) {
      json["more_ranges"] = layout.ranges.size() - most_shown_ranges;
      break;
    }
    at = one.offset.value_or(at);
    const std::size_t size = std::min(one.bytes.value_or(0), payload.size() - std::min(at, payload.size()));
    rows.push_back({{"offset", one.offset_text},
                    {"size", one.size_text},
                    {"depth", one.depth},
                    {"path", one.path},
                    {"type", one.type},
                    {"rule", one.rule},
                    {"value", one.value},
                    {"hex", size == 0 ? std::string{} : hex_of(payload.subspan(at, size))}});
  }
}

}  // namespace

tl::expected<BothForms, std::string> both_forms(const ShownMessage& shown) {
  if (shown.map) {
    return mapped_forms(shown, *shown.map);
  }
  const auto plan = messages::ConversionPlan::compile(shown.tree, shown.rules);
  if (!plan) {
    return tl::unexpected{plan.error()};
  }
  messages::ConversionScratch scratch;
  BothForms result;
  if (shown.newest->is_cdr) {
    const auto payload = plan->cdr_to_someip(shown.newest->bytes, scratch);
    if (!payload) {
      return tl::unexpected{to_string(payload.error())};
    }
    result.payload = messages::joined(*payload);
  } else {
    result.payload = shown.newest->bytes;
  }
  const auto sample = plan->someip_to_cdr(result.payload, scratch);
  if (!sample) {
    return tl::unexpected{to_string(sample.error())};
  }
  result.sample = messages::joined(*sample);
  return result;
}

std::string message_json(const ShownMessage& shown) {
  nlohmann::json json{{"route", shown.route}, {"type", shown.type}};
  if (shown.map) {
    json["payload_type"] = shown.map->payload.root().name;
  }
  if (shown.newest) {
    json["at_ns"] = shown.newest->at_ns;
    json["size"] = shown.newest->size;
    if (shown.newest->bytes.empty() && shown.newest->size > 0) {
      json["fault"] = "it is too large to be shown";
    } else if (const auto forms = both_forms(shown); !forms) {
      json["fault"] = forms.error();
      json["hex"] = hex_of(shown.newest->bytes);
      if (!shown.newest->is_cdr) {
        add_layout(json, shown, shown.newest->bytes);  // as far as it goes
      }
    } else {
      json["size"] = forms->payload.size();
      const auto values =
          messages::MessageValues::make(shown.tree, shown.map ? messages::MessageRules{} : shown.rules);
      const auto text =
          values ? values->print_sample(forms->sample, messages::ValueForm::yaml,
                                        {.bytes = messages::BytesForm::hex, .longest = longest_array})
                 : tl::unexpected{values.error()};
      json["values"] = text ? *text : text.error();
      add_layout(json, shown, forms->payload);
    }
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace trestle::console
