#include "bridge/describe/model_source.hpp"

#include <utility>

#include "bridge/messages/types/parsers.hpp"

namespace trestle::describe {
namespace {

void add_id(messages::InterfaceBinding& binding, const std::string& name,
            const std::optional<someip::MethodId>& id) {
  if (id) {
    binding.members.emplace(name, *id);
  }
}

void add_ids(messages::InterfaceBinding& binding, const Service& service, const LoweredMember& member) {
  switch (member.kind) {
    case LoweredMember::Kind::event:
      return add_id(binding, service.events[member.member].name, service.events[member.member].id);
    case LoweredMember::Kind::method:
      return add_id(binding, service.methods[member.member].name, service.methods[member.member].id);
    case LoweredMember::Kind::field: {
      const Field& field = service.fields[member.member];
      add_id(binding, field.name, field.notifier);
      add_id(binding, field.name + ".get", field.getter);
      return add_id(binding, field.name + ".set", field.setter);
    }
  }
}

}  // namespace

ModelSource::ModelSource(const Model& model, Lowered lowered, std::string place)
    : lowered_{std::move(lowered)}, place_{std::move(place)} {
  std::map<std::string, std::size_t> services;
  for (const LoweredMember& member : lowered_.members) {
    const Service& service = model.services[member.service];
    auto& binding = bindings_[member.type];
    if (binding == nullptr) {
      binding = std::make_shared<messages::InterfaceBinding>();
      binding->service = service.id;
      binding->rules = member.rules;
      services[member.type] = member.service;
    }
    if (services[member.type] == member.service && binding->rules == member.rules) {
      add_ids(*binding, service, member);
    }
  }
}

tl::expected<std::optional<messages::InterfaceMessages>, messages::TypeError> ModelSource::find(
    const messages::InterfaceName& interface) const {
  messages::InterfaceMessages found;
  for (const std::string& name : messages::message_names(interface)) {
    const messages::MessageDefinition* const definition = lowered_.definition(name);
    if (definition == nullptr) {
      return std::optional<messages::InterfaceMessages>{};
    }
    found.push_back(*definition);
  }
  messages::add_generated_messages(found, interface, place_);
  return std::optional{std::move(found)};
}

std::shared_ptr<const messages::InterfaceBinding> ModelSource::binding(
    const messages::InterfaceName& interface) const {
  const auto found = bindings_.find(interface.full());
  return found == bindings_.end() ? nullptr : found->second;
}

}  // namespace trestle::describe
