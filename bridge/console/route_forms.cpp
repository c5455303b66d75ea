#include "bridge/console/route_forms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "bridge/console/json_schema.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/record/ros2msg.hpp"

namespace trestle::console {
namespace {

RouteForms::Bytes bytes_of(std::vector<std::byte> bytes) {
  return std::make_shared<const std::vector<std::byte>>(std::move(bytes));
}

}  // namespace

RouteForms::RouteForms(RouteView view)
    : title_{std::move(view.title)},
      ros_schema_{record::ros2msg(view.ros)},
      payload_type_{view.payload.root().name},
      plan_{std::move(view.plan)},
      values_{messages::MessageValues::make(std::move(view.payload), view.rules)} {}

std::string RouteForms::json_schema() const {
  return values_ ? console::json_schema(values_->tree()) : R"({"type":"object"})";
}

tl::expected<RouteForms::Bytes, std::string> RouteForms::cdr(
    const std::shared_ptr<const carry::SeenMessage>& message) {
  if (message->is_cdr) {
    return Bytes{message, &message->bytes};
  }
  const auto sample = plan_.someip_to_cdr(message->bytes, std::chrono::nanoseconds{message->at_ns}, scratch_);
  if (!sample) {
    return tl::unexpected{to_string(sample.error())};
  }
  return bytes_of(messages::joined(*sample));
}

tl::expected<RouteForms::Bytes, std::string> RouteForms::json(const carry::SeenMessage& message) {
  if (!values_) {
    return tl::unexpected{values_.error()};
  }
  std::vector<std::byte> made;
  if (message.is_cdr) {
    const auto payload = plan_.cdr_to_someip(message.bytes, scratch_);
    if (!payload) {
      return tl::unexpected{to_string(payload.error())};
    }
    made = messages::joined(*payload);
  }
  const auto text = values_->print(message.is_cdr ? made : message.bytes, messages::ValueForm::json,
                                   {.bytes = messages::BytesForm::hex, .longest = longest});
  if (!text) {
    return tl::unexpected{text.error()};
  }
  if (text->size() > most_json_bytes) {
    return tl::unexpected{fmt::format("its text would have {} bytes", text->size())};
  }
  std::vector<std::byte> letters(text->size());
  std::ranges::transform(*text, letters.begin(), [](char one) { return static_cast<std::byte>(one); });
  return bytes_of(std::move(letters));
}

}  // namespace trestle::console
