#include "bridge/generate/page_member.hpp"

#include <algorithm>
#include <utility>

#include "bridge/describe/layout.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::generate {
namespace {

using describe::LoweredMember;

template <typename Elements>
std::optional<std::size_t> place_of(const Elements& all, std::string_view key) {
  const auto found = std::ranges::find_if(all, [&](const auto& one) {
    if constexpr (requires { one.selector; }) {
      return describe::member_key(one.name, one.selector) == key;
    } else {
      return one.name == key;
    }
  });
  return found == all.end() ? std::nullopt
                            : std::optional{static_cast<std::size_t>(std::distance(all.begin(), found))};
}

}  // namespace

tl::expected<messages::TypeTree, std::string> PagePart::tree(const PageSystem& system) const {
  if (type.empty()) {
    return tl::unexpected{std::string{"its type has no form in ROS 2, so values cannot be given"}};
  }
  auto library = messages::TypeLibrary::of({system.types, std::make_shared<messages::BuiltinSource>()});
  auto tree = library.resolve(type);
  if (!tree) {
    return tl::unexpected{to_string(tree.error())};
  }
  return std::move(*tree);
}

std::vector<describe::Value> PagePart::values(const describe::System& system,
                                              const messages::MessageDefinition& root) const {
  if (payload.values.size() != 1 ||
      static_cast<std::size_t>(payload.values[0].type) >= system.model.types.size()) {
    return payload.values;
  }
  const describe::Type& only = describe::resolved(system.model, payload.values[0].type);
  const auto source = system.lowered.sources.find(root.name);
  const bool is_itself =
      only.kind == describe::Kind::structure &&
      (only.ros_name == root.name || (source != system.lowered.sources.end() && !only.name.empty() &&
                                      source->second == describe::full_name(only.scope, only.name)));
  return is_itself ? describe::all_members(system.model, only) : payload.values;
}

tl::expected<std::vector<std::byte>, messages::ValueError> PagePart::bytes(messages::TypeTree tree,
                                                                           const std::string& json) const {
  const messages::MessageRules own = messages::rules_for(tree, rules);
  const auto values = messages::MessageValues::make(std::move(tree), own);
  if (!values) {
    return tl::unexpected{messages::ValueError{.place = {}, .field = {}, .text = values.error()}};
  }
  return values->parse(json, messages::ValueForm::json);
}

tl::expected<std::string, std::string> PagePart::yaml(const PageSystem& system, ByteView bytes) const {
  auto message = tree(system);
  if (!message) {
    return tl::unexpected{message.error()};
  }
  const messages::MessageRules own = messages::rules_for(*message, rules);
  const auto values = messages::MessageValues::make(std::move(*message), own);
  if (!values) {
    return tl::unexpected{values.error()};
  }
  return values->print(bytes, messages::ValueForm::yaml, {.longest = 1000});
}

std::optional<PageMember> PageMember::of(const PageSystem& system, const std::string& service,
                                         const std::string& kind, const std::string& member) {
  const describe::Model& model = system.system.model;
  PageMember found;
  found.service_ = system.was_read ? model.service(service) : nullptr;
  if (found.service_ == nullptr) {
    return std::nullopt;
  }
  const auto take = [&](LoweredMember::Kind as, const auto& all, auto& into) {
    if (const auto at = place_of(all, member)) {
      into = &all[*at];
      const auto index = static_cast<std::size_t>(found.service_ - model.services.data());
      found.lowered_ = system.system.lowered.member(as, index, *at);
    }
    return into != nullptr;
  };
  const bool is_there =
      kind == "methods"  ? take(LoweredMember::Kind::method, found.service_->methods, found.method_)
      : kind == "events" ? take(LoweredMember::Kind::event, found.service_->events, found.event_)
      : kind == "fields" ? take(LoweredMember::Kind::field, found.service_->fields, found.field_)
                         : false;
  return is_there ? std::optional{found} : std::nullopt;
}

PagePart PageMember::part(const describe::Model& model, bool response) const {
  PagePart part;
  if (lowered_ != nullptr) {
    part.type = lowered_->type;
    part.rules = lowered_->rules;
  }
  if (method_ == nullptr) {
    part.payload = event_ != nullptr ? event_->payload : field_->payload;
    return part;
  }
  if (lowered_ != nullptr) {
    part.type += messages::service_suffixes[response ? 1 : 0];
  }
  if (!response) {
    part.payload = method_->request;
    return part;
  }
  part.payload = describe::response_of(model, *method_);
  if (lowered_ != nullptr) {
    part.rules = lowered_->response;
  }
  return part;
}

}  // namespace trestle::generate
