#include "bridge/describe/interfaces.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/model_source.hpp"
#include "bridge/describe/refused.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/convert/service_plans.hpp"

namespace trestle::describe {
namespace {

using Part = ServiceElement::Part;
using Meaning = Interfaces::Meaning;

/// More names than this are not listed.
constexpr std::size_t most_listed = 60;

messages::TypeLibrary library_of(const System& system) {
  messages::TypePlaces places;
  places.described.push_back(std::make_shared<ModelSource>(system.lowered, "the interface descriptions"));
  return messages::TypeLibrary::in(places);
}

bool has_values(const Service& service) {
  const auto any = [](const Payload& payload) { return !payload.values.empty(); };
  return std::ranges::any_of(service.events, any, &Event::payload) ||
         std::ranges::any_of(service.fields, any, &Field::payload) ||
         std::ranges::any_of(service.methods, [&](const Method& one) {
           return any(one.request) || any(one.response) || one.error != no_type;
         });
}

/// Whether the element is what a name means: of a field without a part, all of its parts.
bool is_meant(const ServiceElement& element, const NamedMember& named) {
  const bool is_whole = named.part == NamedMember::Part::whole;
  switch (element.part) {
    case Part::event:
      return named.kind == LoweredMember::Kind::event && named.index == element.member;
    case Part::method:
      return named.kind == LoweredMember::Kind::method && named.index == element.member && is_whole;
    case Part::getter:
    case Part::setter:
    case Part::notifier:
      break;
  }
  const auto part = element.part == Part::getter   ? NamedMember::Part::getter
                    : element.part == Part::setter ? NamedMember::Part::setter
                                                   : NamedMember::Part::notifier;
  return named.kind == LoweredMember::Kind::field && named.index == element.member &&
         (is_whole || named.part == part);
}

LoweredMember::Kind kind_of(Part part) {
  return part == Part::event    ? LoweredMember::Kind::event
         : part == Part::method ? LoweredMember::Kind::method
                                : LoweredMember::Kind::field;
}

}  // namespace

const char* field_part(Part part) noexcept {
  switch (part) {
    case Part::getter:
      return "get";
    case Part::setter:
      return "set";
    case Part::notifier:
      return "notify";
    case Part::event:
    case Part::method:
      break;
  }
  return "";
}

std::vector<std::byte> Content::without_header(ByteView payload, std::vector<std::byte>* header) const {
  if (payload.size() < e2e.at + e2e.bytes) {
    return {payload.begin(), payload.end()};
  }
  const ByteView before = payload.first(e2e.at);
  const ByteView behind = payload.subspan(e2e.at + e2e.bytes);
  std::vector<std::byte> rest{before.begin(), before.end()};
  rest.insert(rest.end(), behind.begin(), behind.end());
  if (header != nullptr) {
    const ByteView own = payload.subspan(e2e.at, e2e.bytes);
    header->assign(own.begin(), own.end());
  }
  return rest;
}

Interfaces::Interfaces(System system)
    : system_{std::move(system)}, service_names_{system_.model}, library_{library_of(system_)} {
  std::map<std::string, std::size_t, std::less<>> count;
  for (const Service& service : system_.model.services) {
    ++count[service.name];
  }
  for (std::size_t i = 0; i < system_.model.services.size(); ++i) {
    const Service& service = system_.model.services[i];
    names_.push_back(count[service.name] == 1 ? service.name : full_name(service.scope, service.name));
    has_types_.push_back(has_values(service));
    first_elements_.push_back(elements_.size());
    add_elements(i);
  }
  first_elements_.push_back(elements_.size());
}

void Interfaces::add(ServiceElement element, const std::optional<someip::MethodId>& id) {
  if (!id) {
    return;
  }
  element.id = *id;
  element.name = names_[element.service] + "." + element.member_name;
  if (element.is_field()) {
    element.name += std::string{"."} + field_part(element.part);
  }
  elements_.push_back(std::make_unique<const ServiceElement>(std::move(element)));
  if (const auto service = system_.model.services[elements_.back()->service].id) {
    by_ids_.emplace(Ids{*service, *id}, elements_.back().get());
  }
}

void Interfaces::add_elements(std::size_t index) {
  const Service& service = system_.model.services[index];
  for (std::size_t i = 0; i < service.events.size(); ++i) {
    const Event& event = service.events[i];
    add({.part = Part::event,
         .service = index,
         .member = i,
         .member_name = member_key(event.name, event.selector),
         .eventgroups = event.eventgroups,
         .transport = event.transfer.transport},
        event.id);
  }
  for (std::size_t i = 0; i < service.methods.size(); ++i) {
    const Method& method = service.methods[i];
    add({.part = Part::method,
         .service = index,
         .member = i,
         .member_name = member_key(method.name, method.selector),
         .transport = method.request_transfer.transport,
         .fire_and_forget = method.fire_and_forget},
        method.id);
  }
  for (std::size_t i = 0; i < service.fields.size(); ++i) {
    const Field& field = service.fields[i];
    ServiceElement element{.part = Part::getter,
                           .service = index,
                           .member = i,
                           .member_name = field.name,
                           .transport = field.getter_transfer.transport};
    add(element, field.has_getter ? field.getter : std::nullopt);
    element.part = Part::setter;
    element.transport = field.setter_transfer.transport;
    add(element, field.has_setter ? field.setter : std::nullopt);
    element.part = Part::notifier;
    element.transport = field.notifier_transfer.transport;
    element.eventgroups = field.eventgroups;
    add(std::move(element), field.has_notifier ? field.notifier : std::nullopt);
  }
}

tl::expected<Meaning, std::string> Interfaces::find_in(std::size_t service, std::string_view text) const {
  Meaning meaning{.service = service};
  for (const NamedMember& named : named_members(system_.model.services[service], text)) {
    for (std::size_t i = first_elements_[service]; i < first_elements_[service + 1]; ++i) {
      if (is_meant(*elements_[i], named)) {
        meaning.elements.push_back(elements_[i].get());
      }
    }
  }
  if (meaning.elements.empty()) {
    return tl::unexpected{not_found(text, service)};
  }
  return meaning;
}

tl::expected<Meaning, std::string> Interfaces::find(std::string_view text) const {
  std::optional<Meaning> found;
  std::optional<NamedService> without;  // of which the text names nothing that is there
  for (const NamedService& named : service_names_.find(text)) {
    Meaning meaning{.service = named.service, .instance = named.instance};
    if (!named.rest.empty()) {
      const auto inside = find_in(named.service, named.rest);
      if (!inside) {
        without = named;
        continue;
      }
      meaning.elements = inside->elements;
    }
    if (found) {
      return tl::unexpected{
          several_services(system_.model.services[found->service], system_.model.services[named.service])};
    }
    found = std::move(meaning);
  }
  if (found) {
    return *found;
  }
  return tl::unexpected{without ? not_found(without->rest, without->service) : not_found(text, std::nullopt)};
}

std::vector<std::string> Interfaces::known_names(std::optional<std::size_t> service) const {
  std::vector<std::string> names;
  if (!service) {
    return names_;
  }
  for (std::size_t i = first_elements_[*service]; i < first_elements_[*service + 1]; ++i) {
    if (names.empty() || names.back() != elements_[i]->member_name) {
      names.push_back(elements_[i]->member_name);
    }
  }
  return names;
}

std::string Interfaces::not_found(std::string_view text, std::optional<std::size_t> service) const {
  const std::vector<std::string> known = known_names(service);
  std::string likely = documents::nearest(text, known);
  if (likely.empty() && !service) {
    std::vector<std::string> all;
    for (const auto& element : elements_) {
      all.push_back(names_[element->service] + "." + element->member_name);
    }
    likely = documents::nearest(text, all);
  }
  std::string list;
  for (std::size_t i = 0; i < std::min(known.size(), most_listed); ++i) {
    list += (i == 0 ? "" : ", ") + known[i];
  }
  list += known.size() > most_listed ? fmt::format(" and {} more", known.size() - most_listed) : "";
  const std::string what =
      service ? fmt::format("{} has no {}", names_[*service], documents::quote(std::string{text}))
              : fmt::format("the interfaces have no service {}", documents::quote(std::string{text}));
  return fmt::format("{}{}; there {}: {}", what,
                     likely.empty() ? "" : "; did you mean " + documents::quote(likely) + "?",
                     known.size() == 1 ? "is" : "are", known.empty() ? "none" : list);
}

const Service* Interfaces::service(someip::ServiceId id, std::optional<std::uint8_t> major) const {
  const Service* found = nullptr;
  for (const Service& service : system_.model.services) {
    if (service.id == id && (found == nullptr || (major && service.major == *major))) {
      found = &service;
    }
  }
  return found;
}

const ServiceElement* Interfaces::element(someip::ServiceId service, std::uint8_t major,
                                          someip::MethodId id) const {
  const auto [begin, end] = by_ids_.equal_range({service, id});
  const ServiceElement* found = nullptr;
  for (auto at = begin; at != end; ++at) {
    if (found == nullptr || system_.model.services[at->second->service].major == major) {
      found = at->second;
    }
  }
  return found;
}

std::vector<const ServiceElement*> Interfaces::elements_of(std::size_t service) const {
  std::vector<const ServiceElement*> all;
  for (std::size_t i = first_elements_[service]; i < first_elements_[service + 1]; ++i) {
    all.push_back(elements_[i].get());
  }
  return all;
}

std::vector<const Instance*> Interfaces::instances_of(std::size_t service) const {
  std::vector<const Instance*> all;
  for (const Instance& instance : system_.model.instances) {
    if (!instance.id || !is_of(instance, system_.model.services[service])) {
      continue;
    }
    const auto same = std::ranges::find(all, instance.id, &Instance::id);
    if (same == all.end()) {
      all.push_back(&instance);
    } else if (instance.role == Instance::Role::provided) {
      *same = &instance;
    }
  }
  return all;
}

std::string Interfaces::name_of(someip::ServiceId id, std::optional<std::uint8_t> major) const {
  const Service* const found = service(id, major);
  return found == nullptr ? fmt::format("0x{:04x}", someip::value(id))
                          : names_[static_cast<std::size_t>(found - system_.model.services.data())];
}

std::string Interfaces::eventgroup_name(someip::ServiceId id, someip::EventgroupId eventgroup) const {
  const Service* const found = service(id);
  if (found == nullptr) {
    return {};
  }
  const auto at = std::ranges::find(found->eventgroups, eventgroup, &Eventgroup::id);
  return at == found->eventgroups.end() ? std::string{} : at->name;
}

const Protection* Interfaces::protection(const ServiceElement& element,
                                         std::optional<someip::InstanceId> instance) const {
  const Protection& e2e = protection_of(element).of(instance);
  return e2e.empty() ? nullptr : &e2e;
}

const Protection& Interfaces::protection_of(const ServiceElement& element) const {
  const Service& service = system_.model.services[element.service];
  switch (element.part) {
    case Part::event:
      return service.events[element.member].e2e;
    case Part::method:
      return service.methods[element.member].e2e;
    case Part::notifier:
      return service.fields[element.member].e2e;
    case Part::getter:
      return service.fields[element.member].getter_e2e;
    case Part::setter:
      break;
  }
  return service.fields[element.member].setter_e2e;
}

const Content& Interfaces::content(const ServiceElement& element, bool is_answer) const {
  auto& content = contents_[{&element, is_answer}];
  if (content == nullptr) {
    content = std::make_unique<const Content>(make_content(element, is_answer));
  }
  return *content;
}

Content Interfaces::make_content(const ServiceElement& element, bool is_answer) const {
  const Service& service = system_.model.services[element.service];
  Content content;
  if (!has_types_[element.service]) {
    content.unknown = "the description has no types";
    return content;
  }
  const LoweredMember* const lowered =
      system_.lowered.member(kind_of(element.part), element.service, element.member);
  std::string type = lowered == nullptr ? "" : lowered->type;
  const Payload* payload = nullptr;
  switch (element.part) {
    case Part::event:
      payload = &service.events[element.member].payload;
      content.is_empty = payload->values.empty();
      break;
    case Part::method: {
      const Method& method = service.methods[element.member];
      payload = is_answer ? &method.response : &method.request;
      content.is_empty = payload->values.empty() && (!is_answer || method.error == no_type);
      type += messages::service_suffixes[is_answer ? 1 : 0];
      break;
    }
    case Part::getter:
    case Part::notifier:
    case Part::setter:
      content.is_empty = element.part == Part::getter && !is_answer;
      payload = content.is_empty ? nullptr : &service.fields[element.member].payload;
      break;
  }
  if (std::string crc = payload == nullptr ? std::string{} : crc_fault(*payload); !crc.empty()) {
    content.has_crc = true;
    content.is_empty = false;
    content.unknown = std::move(crc);
    return content;
  }
  const Protection& e2e = protection_of(element);
  const auto header = protection_header(e2e);
  if (!header) {
    content.unknown = no_header_text(e2e);
    return content;
  }
  content.e2e = *header;
  if (content.is_empty) {
    return content;
  }
  if (lowered == nullptr) {
    content.unknown = why_not_carried(system_.lowered, service, element.member_name);
    return content;
  }
  auto tree = library_.resolve(type);
  if (!tree) {
    content.unknown = to_string(tree.error());
    return content;
  }
  messages::Words words{.name = element.name, .argument = lowered->argument};
  for (const messages::MessageDefinition& message : tree->messages) {
    const auto found = system_.lowered.words.find(message.name);
    words.messages.push_back(found == system_.lowered.words.end() ? messages::MessageWords{} : found->second);
  }
  if (is_answer && element.part == Part::method) {
    words.name = "answer of " + words.name;
  }
  const bool by_response = is_answer && element.part == Part::method;
  // Those of a method are for request and answer together.
  messages::MessageRules wanted = rules_for(*tree, by_response ? lowered->response : lowered->rules);
  auto values = messages::MessageValues::make(std::move(*tree), wanted, std::move(words));
  if (values) {
    content.values = std::move(*values);
  } else {
    content.unknown = values.error();
  }
  return content;
}

}  // namespace trestle::describe
