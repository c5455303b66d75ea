#pragma once
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/map/mapped_plan.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/values/message_values.hpp"
#include "bridge/picture/seen_message.hpp"

namespace trestle::console {

/// A route, and what it takes to understand its messages on both sides.
struct RouteView {
  carry::RouteTitle title;
  messages::TypeTree ros;      ///< of the topic
  messages::TypeTree payload;  ///< in SOME/IP; the same unless the route maps fields
  messages::MessageRules rules;
  messages::MappedPlan plan;  ///< in the direction of the route
};

/// Puts messages of one route into the forms that viewers get. For one thread.
class RouteForms {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::byte>>;

  /// Arrays and strings in JSON are cut behind so many elements or bytes.
  static constexpr std::size_t longest = 4096;
  /// Arrays may stand within arrays: JSON of more bytes is none.
  static constexpr std::size_t most_json_bytes = std::size_t{16} << 20U;

  explicit RouteForms(RouteView view);

  [[nodiscard]] const carry::RouteTitle& title() const noexcept { return title_; }
  /// Of the topic, as "ros2msg".
  [[nodiscard]] const std::string& ros_schema() const noexcept { return ros_schema_; }
  /// The name of what is in SOME/IP, and what JSON of it looks like: a JSON Schema.
  [[nodiscard]] const std::string& payload_type() const noexcept { return payload_type_; }
  [[nodiscard]] std::string json_schema() const;

  /// CDR as on the topic, with its encapsulation header. @return or why it is none.
  [[nodiscard]] tl::expected<Bytes, std::string> cdr(
      const std::shared_ptr<const carry::SeenMessage>& message);
  /// The values of the SOME/IP payload, as `trestle decode` prints them.
  [[nodiscard]] tl::expected<Bytes, std::string> json(const carry::SeenMessage& message);

 private:
  carry::RouteTitle title_;
  std::string ros_schema_;
  std::string payload_type_;
  messages::MappedPlan plan_;
  messages::MappedScratch scratch_;
  tl::expected<messages::MessageValues, std::string> values_;
};

}  // namespace trestle::console
