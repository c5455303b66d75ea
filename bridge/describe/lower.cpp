#include "bridge/describe/lower.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/lower_types.hpp"
#include "bridge/describe/refused.hpp"
#include "bridge/describe/ros_names.hpp"

namespace trestle::describe {
namespace {

constexpr std::string_view request_end = "_Request";
constexpr std::string_view response_end = "_Response";

class Lowering {
 public:
  Lowering(const Model& model, const LowerOptions& options)
      : model_{model}, types_{model, options, result_} {}

  Lowered made() {
    for (std::size_t i = 0; i < model_.types.size(); ++i) {
      const Type& type = model_.types[i];
      const bool has_shape = type.kind == Kind::structure || type.kind == Kind::choice;
      if (has_shape && !is_polymorphic(model_, type) && !(type.name.empty() && type.ros_name.empty())) {
        types_.shape_of(TypeIndex{static_cast<std::uint32_t>(i)});
      }
    }
    types_.add_constants();
    for (std::size_t i = 0; i < model_.services.size(); ++i) {
      service(i);
    }
    leave_out_refused(model_, result_);
    return std::move(result_);
  }

 private:
  /// What a payload is: its shape, and how it is laid out as a whole.
  using Root = std::pair<std::size_t, std::optional<Wire>>;

  void service(std::size_t index) {
    const Service& service = model_.services[index];
    const std::string source = full_name(service.scope, service.name);
    const std::string package = types_.package_of(service.scope, service.place);
    const auto name = [&](const char* kind, const auto& member) {
      return types_.fit(package + kind + ros_type_name(service.name) + ros_type_name(member.name),
                        source + "." + member.name, member.place);
    };
    for (std::size_t i = 0; i < service.events.size(); ++i) {
      const Event& event = service.events[i];
      value({LoweredMember::Kind::event, index, i}, event.payload, name("/msg/", event),
            source + "." + event.name, event.notes, event.place);
    }
    for (std::size_t i = 0; i < service.methods.size(); ++i) {
      method({LoweredMember::Kind::method, index, i}, service.methods[i], name("/srv/", service.methods[i]),
             source + "." + service.methods[i].name);
    }
    for (std::size_t i = 0; i < service.fields.size(); ++i) {
      const Field& field = service.fields[i];
      value({LoweredMember::Kind::field, index, i}, field.payload, name("/msg/", field),
            source + "." + field.name, field.notes, field.place);
    }
  }

  /// Of an event or a field.
  void value(LoweredMember member, const Payload& payload, const std::string& name, const std::string& source,
             const Notes& notes, Place place) {
    const bool is_carried = check(payload, source, place);
    if (!payload.known) {
      types_.complain(source, "what it carries is not known", place);
      return;
    }
    auto root = single_structure(payload.values);
    if (root) {
      member.argument = payload.values.front().name;
    } else {
      root = own(payload.values, name, source);
    }
    if (!root) {
      types_.complain(source, "no message could be made of what it carries", place);
      return;
    }
    member.type = types_.shapes()[root->first].definition.name;
    member.rules = rules_of(types_.shapes(), {*root}, payload);
    result_.notes.emplace(member.type, notes);
    if (is_carried) {
      result_.members.push_back(std::move(member));
    }
  }

  void method(LoweredMember member, const Method& method, std::string name, const std::string& source) {
    const bool is_request_carried = check(method.request, source, method.place);
    const bool is_carried =
        is_request_carried && (method.fire_and_forget || check(method.response, source, method.place));
    if (!method.request.known || (!method.response.known && !method.fire_and_forget)) {
      types_.complain(source, "what it carries is not known", method.place);
      return;
    }
    std::vector<Value> answers = method.response.values;
    if (method.error != no_type) {
      const Wire wire = static_cast<std::size_t>(method.error) < model_.types.size()
                            ? resolved(model_, method.error).wire
                            : Wire{};
      answers.insert(answers.begin(), Value{.name = "error", .type = method.error, .wire = wire});
    }
    auto request = named_structure(method.request.values, request_end);
    auto response = named_structure(answers, response_end);
    const auto prefix = [&](const Root& root, std::string_view end) {
      const std::string& full = types_.shapes()[root.first].definition.name;
      return full.substr(0, full.size() - end.size());
    };
    if (request) {
      name = prefix(*request, request_end);
    } else if (response) {
      name = prefix(*response, response_end);
    } else if (!method.ros_type.empty() && method.request.values.empty() && answers.empty()) {
      name = method.ros_type;
    } else {
      name = services_.take(name, "");
    }
    if (request && response && prefix(*response, response_end) != name) {
      response.reset();
    }
    services_.insert(name);
    if (!request) {
      request = own(method.request.values, name + std::string{request_end}, source);
    }
    if (!response) {
      response = own(answers, name + std::string{response_end}, source, method.error != no_type);
    }
    if (!request || !response) {
      types_.complain(source, "no service could be made of its arguments", method.place);
      return;
    }
    member.type = name;
    member.rules = rules_of(types_.shapes(), {*request, *response}, method.request);
    member.response = member.rules;
    member.response.payload.byte_order = method.response.byte_order;
    member.response.payload.length_fields_always_big = method.response.length_fields_always_big;
    member.response.payload.alignment = method.response.alignment;
    member.response.payload.tagged_length = method.response.tagged_length;
    member.response.payload.smallest_tagged_length = method.response.smallest_tagged_length;
    result_.sources.emplace(name, source);
    result_.notes.emplace(name, method.notes);
    if (is_carried) {
      result_.members.push_back(std::move(member));
    }
  }

  /// Whether a bridge can send and read it; says why not. Its messages are made nevertheless.
  bool check(const Payload& payload, const std::string& source, Place place) {
    std::string fault = crc_fault(payload);
    const bool is_carried = fault.empty();
    if (!is_carried) {
      types_.complain(source, std::move(fault), place);
    }
    return is_carried;
  }

  [[nodiscard]] bool is_alone(const std::vector<Value>& values) const {
    if (values.size() != 1 || values[0].type == no_type ||
        static_cast<std::size_t>(values[0].type) >= model_.types.size()) {
      return false;
    }
    const Value& value = values[0];
    return resolved(model_, value.type).kind == Kind::structure && !value.optional && !value.tag &&
           !value.wire.byte_order;
  }

  /// A single structure is the payload itself.
  std::optional<Root> single_structure(const std::vector<Value>& values) {
    if (!is_alone(values)) {
      return std::nullopt;
    }
    const TypeIndex index = behind_aliases(model_, values[0].type);
    const auto shape = types_.shape_of(index);
    return shape ? std::optional{Root{*shape, values[0].wire}} : std::nullopt;
  }

  /// The same of a structure that is bound to a message of a ROS service.
  std::optional<Root> named_structure(const std::vector<Value>& values, std::string_view end) {
    if (!is_alone(values)) {
      return std::nullopt;
    }
    const Type& type = resolved(model_, values[0].type);
    const bool is_of_service = type.ros_name.find("/srv/") != std::string::npos ||
                               type.ros_name.find("/action/") != std::string::npos;
    const bool is_bound = is_of_service && type.ros_name.ends_with(end);
    const auto root = is_bound ? single_structure(values) : std::nullopt;
    return root && types_.shapes()[root->first].definition.name == type.ros_name ? root : std::nullopt;
  }

  std::optional<Root> own(const std::vector<Value>& values, const std::string& name,
                          const std::string& source, bool begins_with_error = false) {
    const auto shape = types_.shape_of(values, name, source, begins_with_error);
    return shape ? std::optional{Root{*shape, std::nullopt}} : std::nullopt;
  }

  const Model& model_;
  Lowered result_;
  TypeLowering types_;
  FreeNames services_;
};

}  // namespace

const messages::MessageDefinition* Lowered::definition(std::string_view name) const {
  const auto found = by_name.find(name);
  return found == by_name.end() ? nullptr : &definitions[found->second];
}

const LoweredMember* Lowered::member(LoweredMember::Kind kind, std::size_t service, std::size_t index) const {
  const auto key = [](const LoweredMember& one) { return std::tuple{one.service, one.kind, one.member}; };
  const auto found = std::ranges::lower_bound(members, std::tuple{service, kind, index}, {}, key);
  return found != members.end() && key(*found) == std::tuple{service, kind, index} ? &*found : nullptr;
}

std::vector<std::string> Lowered::ros_names(std::string_view source) const {
  std::vector<std::string> names;
  for (const auto& [ros, of] : sources) {
    if (of == source) {
      names.push_back(ros);
    }
  }
  return names;
}

Lowered lower(const Model& model, const LowerOptions& options) {
  return Lowering{model, options}.made();
}

}  // namespace trestle::describe
