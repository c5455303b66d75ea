#include "bridge/generate/page_member.hpp"

#include <fmt/format.h>

#include <utility>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/refused.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::generate {
namespace {

using describe::LoweredMember;

/// As the JSON of a model calls it.
std::string_view list_of(LoweredMember::Kind kind) {
  return kind == LoweredMember::Kind::event    ? "events"
         : kind == LoweredMember::Kind::method ? "methods"
                                               : "fields";
}

}  // namespace

tl::expected<messages::TypeTree, std::string> PagePart::tree(const PageSystem& system) const {
  if (type.empty()) {
    return tl::unexpected{fmt::format("values cannot be given: {}", why_no_type)};
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
  const auto index = static_cast<std::size_t>(found.service_ - model.services.data());
  for (const describe::NamedMember& one : describe::named_members(*found.service_, member)) {
    if (one.part != describe::NamedMember::Part::whole || kind != list_of(one.kind)) {
      continue;
    }
    switch (one.kind) {
      case LoweredMember::Kind::event:
        found.event_ = &found.service_->events[one.index];
        break;
      case LoweredMember::Kind::method:
        found.method_ = &found.service_->methods[one.index];
        break;
      case LoweredMember::Kind::field:
        found.field_ = &found.service_->fields[one.index];
        break;
    }
    found.lowered_ = system.system.lowered.member(one.kind, index, one.index);
    if (found.lowered_ == nullptr) {
      found.why_not_lowered_ = describe::why_not_carried(system.system.lowered, *found.service_, member);
    }
    return found;
  }
  return std::nullopt;
}

std::string PageMember::name() const {
  const std::string member = method_ != nullptr  ? describe::member_key(method_->name, method_->selector)
                             : event_ != nullptr ? describe::member_key(event_->name, event_->selector)
                                                 : field_->name;
  return service_->name + "." + member;
}

const describe::Protection& PageMember::protection(bool gets) const {
  return method_ != nullptr ? method_->e2e : gets ? field_->getter_e2e : field_->setter_e2e;
}

PagePart PageMember::part(const describe::Model& model, bool response) const {
  PagePart part{.why_no_type = why_not_lowered_};
  if (lowered_ != nullptr) {
    part.type = lowered_->type;
    part.rules = lowered_->rules;
  }
  if (method_ == nullptr) {
    part.payload = event_ != nullptr ? event_->payload : field_->payload;
    part.e2e = event_ != nullptr ? event_->e2e : field_->e2e;
    return part;
  }
  if (lowered_ != nullptr) {
    part.type += messages::service_suffixes[response ? 1 : 0];
  }
  part.e2e = method_->e2e;
  part.use = response ? describe::E2eUse::served : describe::E2eUse::called;
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
