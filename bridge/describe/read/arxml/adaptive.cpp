#include "bridge/describe/read/arxml/adaptive.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "bridge/describe/join.hpp"
#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

namespace {

[[nodiscard]] std::string hex(std::uint32_t value) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string out = "0x";
  for (int shift = 12; shift >= 0; shift -= 4) {
    out += digits[(value >> static_cast<unsigned>(shift)) & 15U];
  }
  return out;
}

/// Of a service, as Copies counts.
[[nodiscard]] std::size_t parts_of(const Service& service) {
  std::size_t parts = Copies::of_text(service.notes);
  const auto add = [&](const Notes& notes, std::initializer_list<const Payload*> payloads) {
    parts += Copies::of_member + Copies::of_text(notes);
    for (const Payload* const payload : payloads) {
      for (const Value& value : payload->values) {
        parts += 1 + Copies::of_text(value.notes);
      }
    }
  };
  for (const Event& event : service.events) {
    add(event.notes, {&event.payload});
  }
  for (const Field& field : service.fields) {
    add(field.notes, {&field.payload});
  }
  for (const Method& method : service.methods) {
    add(method.notes, {&method.request, &method.response});
    for (const std::string& error : method.application_errors) {
      parts += 1 + Copies::of_text(error.size());
    }
  }
  return parts;
}

}  // namespace

std::optional<std::uint32_t> number_in(const Node* node, std::uint32_t least, std::uint32_t most,
                                       Problems& problems) {
  if (node == nullptr) {
    return std::nullopt;
  }
  const std::optional<std::int64_t> value = integer(node->text);
  if (!value || *value < least || *value > most) {
    problems.error(node->place(), std::string{to_string(node->tag)} + " is \"" + std::string{node->text} +
                                      "\", and a number from " + std::to_string(least) + " to " +
                                      std::to_string(most) + " was expected");
    return std::nullopt;
  }
  return static_cast<std::uint32_t>(*value);
}

void Adaptive::read() {
  find_protections();
  std::map<const Node*, std::vector<const Node*>> deployments;
  std::vector<const Node*> alone;
  for (const Node* const deployment : tree_.all("SOMEIP-SERVICE-INTERFACE-DEPLOYMENT"_tag)) {
    const Node* const reference = deployment->child("SERVICE-INTERFACE-REF"_tag);
    const Node* const interface = reference == nullptr ? nullptr : tree_.resolve(*reference);
    if (interface != nullptr && interface->tag == "SERVICE-INTERFACE"_tag) {
      deployments[interface].push_back(deployment);
      continue;
    }
    alone.push_back(deployment);
    problems_.warning(reference == nullptr ? deployment->place() : reference->place(),
                      reference == nullptr
                          ? Tree::path(deployment) + " has no SERVICE-INTERFACE-REF: its types are not known"
                          : "the service interface " + std::string{reference->text} +
                                " is in none of the files: its types are not known");
  }
  for (const Node* const interface : tree_.all("SERVICE-INTERFACE"_tag)) {
    const std::vector<const Node*>& list = deployments[interface];
    if (list.empty()) {
      read_service(interface, nullptr, false);
    }
    std::size_t parts = 0;
    for (const Node* const deployment : list) {
      if (deployment != list.front()) {
        if (!copies_.take(deployment->place(), parts)) {
          break;
        }
        problems_.warning(deployment->place(), Tree::path(interface) +
                                                   " is deployed more than once: the service of " +
                                                   Tree::path(deployment) + " gets the name of that");
      }
      read_service(interface, deployment, deployment != list.front());
      parts = deployment == list.front() && list.size() > 1 ? parts_of(model_.services.back()) : parts;
    }
  }
  for (const Node* const deployment : alone) {
    read_service(nullptr, deployment, false);
  }
  read_machines();
  for (const Node* const node : tree_.all("PROVIDED-SOMEIP-SERVICE-INSTANCE"_tag)) {
    read_instance(*node, Instance::Role::provided);
  }
  for (const Node* const node : tree_.all("REQUIRED-SOMEIP-SERVICE-INSTANCE"_tag)) {
    read_instance(*node, Instance::Role::required);
  }
  read_places();
}

void Adaptive::read_service(const Node* interface, const Node* deployment, bool further) {
  Parts parts;
  Service& service = parts.service;
  const Node& names = further || interface == nullptr ? *deployment : *interface;
  service.name = names.name;
  service.scope = Tree::scope(names);
  service.place = names.place();
  if (interface != nullptr) {
    read_interface(*interface, parts);
  }
  if (deployment != nullptr) {
    read_deployment(*deployment, parts, interface != nullptr);
    deployed_[deployment] = {full_name(service.scope, service.name), service.id};
  }
  if (interface == nullptr) {  // which has the types
    for (Event& event : service.events) {
      event.payload.known = false;
    }
    for (Method& method : service.methods) {
      method.request.known = method.response.known = false;
    }
    for (Field& field : service.fields) {
      field.payload.known = false;
    }
  }
  read_protections(parts);
  std::ranges::sort(service.eventgroups, {}, &Eventgroup::id);
  model_.services.push_back(std::move(service));
}

// --- interfaces -------------------------------------------------------------------------------------------

void Adaptive::read_interface(const Node& interface, Parts& parts) {
  Service& service = parts.service;
  service.notes = notes_beside(interface);
  each_in(&interface, "NAMESPACES"_tag, "SYMBOL-PROPS"_tag, [&](const Node& symbol) {
    const std::string_view text = symbol.child_text("SYMBOL"_tag);
    service.namespaces.emplace_back(text.empty() ? symbol.name : text);
  });
  if (const auto major = number_in(interface.child("MAJOR-VERSION"_tag), 0, 0xff, problems_)) {
    service.major = static_cast<std::uint8_t>(*major);
    service.has_version = true;
  }
  if (const auto minor = number_in(interface.child("MINOR-VERSION"_tag), 0, 0xffff'ffff, problems_)) {
    service.minor = *minor;
  }
  // Every target tells members by their names.
  using Names = std::map<std::string_view, const Node*>;
  const auto is_new = [&](Names& names, const Node& node) {
    if (node.name.empty()) {
      return true;
    }
    const auto [first, is] = names.emplace(node.name, &node);
    if (!is) {
      problems_.warning(node.place(), Tree::path(&node) +
                                          " is there twice: this one is left out, the one at " +
                                          to_string(model_, first->second->place()) + " is taken");
    }
    return is;
  };
  Names event_names;
  Names method_names;
  Names field_names;
  // Pointers to elements are taken only when there are no more to come.
  std::vector<const Node*> events;
  each_in(&interface, "EVENTS"_tag, "VARIABLE-DATA-PROTOTYPE"_tag, [&](const Node& node) {
    if (!is_new(event_names, node)) {
      return;
    }
    Event event{.name = std::string{node.name}};
    const Context& context = contexts_.of(&node);
    contexts_.fill(event.payload, context);
    event.notes = notes_beside(node);
    event.place = node.place();
    if (auto arguments = types_.arguments(node, context)) {
      event.payload.values = std::move(*arguments);
    } else {
      Value value = types_.value(node, context);
      // The notes are the event's; write/arxml puts the argument's name there where it is another one.
      if (const auto name = event.notes.others.find("argument"); name != event.notes.others.end()) {
        value.name = name->second;
        event.notes.others.erase(name);
      }
      value.notes.others.erase("argument");
      value.notes.description.clear();
      for (const auto& [key, text] : event.notes.others) {
        value.notes.others.erase(key);
      }
      if (!event.notes.unit.empty()) {
        value.notes.unit = std::exchange(event.notes.unit, {});
      }
      event.payload.values.push_back(std::move(value));
    }
    service.events.push_back(std::move(event));
    events.push_back(&node);
  });
  each_in(&interface, "TRIGGERS"_tag, "TRIGGER"_tag, [&](const Node& node) {
    if (!is_new(event_names, node)) {
      return;
    }
    service.events.push_back(
        {.name = std::string{node.name}, .notes = notes_beside(node), .place = node.place()});
    contexts_.fill(service.events.back().payload, contexts_.of(&node));
    events.push_back(&node);
  });
  std::vector<const Node*> methods;
  each_in(&interface, "METHODS"_tag, "CLIENT-SERVER-OPERATION"_tag, [&](const Node& node) {
    if (is_new(method_names, node)) {
      service.methods.push_back(read_method(node));
      methods.push_back(&node);
    }
  });
  std::vector<const Node*> fields;
  each_in(&interface, "FIELDS"_tag, "FIELD"_tag, [&](const Node& node) {
    if (!is_new(field_names, node)) {
      return;
    }
    Field field{.name = std::string{node.name}};
    const Context& context = contexts_.of(&node);
    contexts_.fill(field.payload, context);
    field.notes = notes_beside(node);
    field.place = node.place();
    Value value = types_.value(node, context);
    value.notes.description.clear();
    if (!field.notes.unit.empty()) {
      value.notes.unit = std::exchange(field.notes.unit, {});
    }
    for (const auto& [key, text] : field.notes.others) {
      value.notes.others.erase(key);
    }
    field.payload.values.push_back(std::move(value));
    const auto has = [&](Tag tag, bool& part) {
      const Node* const said = node.child(tag);
      part = said == nullptr ? part : boolean(said->text).value_or(part);
    };
    has("HAS-GETTER"_tag, field.has_getter);
    has("HAS-SETTER"_tag, field.has_setter);
    has("HAS-NOTIFIER"_tag, field.has_notifier);
    service.fields.push_back(std::move(field));
    fields.push_back(&node);
  });
  for (std::size_t i = 0; i < events.size(); ++i) {
    parts.events[events[i]] = &service.events[i];
  }
  for (std::size_t i = 0; i < methods.size(); ++i) {
    parts.methods[methods[i]] = &service.methods[i];
  }
  for (std::size_t i = 0; i < fields.size(); ++i) {
    parts.fields[fields[i]] = &service.fields[i];
  }
}

Method Adaptive::read_method(const Node& operation) {
  Method method{.name = std::string{operation.name}};
  const Context& context = contexts_.of(&operation);
  contexts_.fill(method.request, context);
  contexts_.fill(method.response, context);
  method.notes = notes_beside(operation);
  method.place = operation.place();
  method.fire_and_forget = boolean(operation.child_text("FIRE-AND-FORGET"_tag)).value_or(false);
  each_in(&operation, "ARGUMENTS"_tag, "ARGUMENT-DATA-PROTOTYPE"_tag, [&](const Node& argument) {
    Value value = types_.value(argument, context);
    value.tag = contexts_.tag(context, &argument);
    const std::string_view direction = argument.child_text("DIRECTION"_tag);
    if (direction != "IN" && direction != "OUT" && direction != "INOUT") {
      problems_.warning(argument.place(), "the DIRECTION of " + Tree::path(&argument) +
                                              " is neither IN, OUT nor INOUT; IN is taken");
    }
    if (direction == "INOUT") {
      method.inout.push_back(value.name);
    }
    if (direction == "OUT" || direction == "INOUT") {
      method.response.values.push_back(value);
    }
    if (direction != "OUT") {
      method.request.values.push_back(std::move(value));
    }
  });
  const auto add_error = [&](const Node& reference) {
    method.application_errors.emplace_back(reference.text);
  };
  each_in(&operation, "POSSIBLE-AP-ERROR-REFS"_tag, "POSSIBLE-AP-ERROR-REF"_tag, add_error);
  each_in(&operation, "POSSIBLE-ERROR-REFS"_tag, "POSSIBLE-ERROR-REF"_tag, add_error);
  each_in(&operation, "POSSIBLE-AP-ERROR-SET-REFS"_tag, "POSSIBLE-AP-ERROR-SET-REF"_tag,
          [&](const Node& reference) {
            each_in(copies_.full() ? nullptr : tree_.resolve(reference), "AP-APPLICATION-ERROR-REFS"_tag,
                    "AP-APPLICATION-ERROR-REF"_tag, [&](const Node& error) {
                      if (copies_.take(reference.place(), 1 + Copies::of_text(error.text.size()))) {
                        add_error(error);
                      }
                    });
          });
  return method;
}

// --- deployments ------------------------------------------------------------------------------------------

std::optional<someip::MethodId> Adaptive::method_id(const Node* id, Place& place) {
  const auto value = number_in(id, 0, 0xffff, problems_);
  place = id == nullptr ? Place{} : id->place();
  // Tools write 0 for what is not there [feat_req_someipids_636].
  if (value && *value == 0) {
    problems_.warning(id->place(),
                      "METHOD-ID 0 is reserved: it counts as not given, and where an id is "
                      "needed, one is chosen");
  }
  return value.value_or(0) != 0 ? std::optional{static_cast<someip::MethodId>(*value)} : std::nullopt;
}

std::optional<someip::MethodId> Adaptive::event_id(const Node* id, std::size_t& changed, Place& place) {
  auto value = number_in(id, 0, 0xffff, problems_);
  place = id == nullptr ? Place{} : id->place();
  if (value && *value < 0x8000 && options_.set_event_bit) {
    *value |= 0x8000U;
    ++changed;
  }
  return value ? std::optional{static_cast<someip::MethodId>(*value)} : std::nullopt;
}

void Adaptive::read_transfer(const Node& deployment, Tag segment, Tag separation, Transfer& transfer) {
  const std::string_view protocol = deployment.child_text("TRANSPORT-PROTOCOL"_tag);
  if (!protocol.empty()) {
    transfer.transport_at = deployment.child("TRANSPORT-PROTOCOL"_tag)->place();
  }
  if (protocol == "TCP") {
    transfer.transport = Transport::tcp;
  } else if (!protocol.empty() && protocol != "UDP") {
    problems_.error(deployment.child("TRANSPORT-PROTOCOL"_tag)->place(),
                    "TRANSPORT-PROTOCOL is " + std::string{protocol} + ", and UDP or TCP was expected");
  }
  const Node* const length = deployment.child(segment);
  if (const auto bytes = number_in(length, 0, 0xffff, problems_); bytes && *bytes > 0) {
    // With what of the SOME/IP header is in each segment, and the TP header.
    constexpr std::uint32_t headers = 8 + 4;
    if (*bytes < headers + 16) {
      problems_.error(length->place(),
                      std::string{to_string(segment)} + " is " + std::to_string(*bytes) +
                          ", and at least 28 was expected: 12 bytes of headers and 16 of payload");
    } else {
      transfer.segment_bytes = (*bytes - headers) / 16 * 16;
      transfer.segment_bytes_at = length->place();
      if (transfer.segment_bytes + headers != *bytes) {
        problems_.warning(length->place(), std::string{to_string(segment)} + " is " + std::to_string(*bytes) +
                                               ", and 12 and a multiple of 16 was expected; segments have " +
                                               std::to_string(transfer.segment_bytes) + " bytes of payload");
      }
    }
  }
  if (const Node* const time = deployment.child(separation); time != nullptr) {
    if (const auto value = seconds(time->text)) {
      transfer.separation = std::chrono::round<std::chrono::microseconds>(*value);
    } else {
      problems_.error(time->place(), std::string{to_string(separation)} + " is \"" + std::string{time->text} +
                                         "\", and seconds were expected");
    }
  }
}

void Adaptive::read_deployment(const Node& deployment, Parts& parts, bool with_interface) {
  Service& service = parts.service;
  if (const auto id = number_in(deployment.child("SERVICE-INTERFACE-ID"_tag), 0, 0xffff, problems_)) {
    service.id = static_cast<someip::ServiceId>(*id);
    service.id_place = deployment.child("SERVICE-INTERFACE-ID"_tag)->place();
    if (*id == 0) {
      // Other tools' files have it where nobody has chosen one yet.
      problems_.warning(
          deployment.child("SERVICE-INTERFACE-ID"_tag)->place(),
          "SERVICE-INTERFACE-ID 0 is reserved: it counts as not given, and one is chosen where it is "
          "needed");
      service.id.reset();
    }
  }
  if (const Node* const version = deployment.child("SERVICE-INTERFACE-VERSION"_tag); version != nullptr) {
    if (const auto major = number_in(version->child("MAJOR-VERSION"_tag), 0, 0xff, problems_)) {
      service.major = static_cast<std::uint8_t>(*major);
      service.has_version = true;
    }
    if (const auto minor = number_in(version->child("MINOR-VERSION"_tag), 0, 0xffff'ffff, problems_)) {
      service.minor = *minor;
    }
  }
  read_methods(deployment, parts, with_interface);
  read_fields(deployment, parts, with_interface);
  read_events(deployment, parts, with_interface);
  read_eventgroups(deployment, parts);
}

namespace {

/// Elements that a deployment has, in a vector that must not move while others point to its elements.
template <typename Element>
[[nodiscard]] Element* added(std::vector<Element>& elements, const Node& node) {
  elements.push_back({});
  elements.back().name = node.name;
  elements.back().place = node.place();
  return &elements.back();
}

[[nodiscard]] std::size_t count(const Node& node, Tag list, Tag tag) {
  std::size_t found = 0;
  each_in(&node, list, tag, [&](const Node&) { ++found; });
  return found;
}

}  // namespace

void Adaptive::read_events(const Node& deployment, Parts& parts, bool with_interface) {
  std::size_t changed = 0;
  const Node* first = nullptr;
  if (!with_interface) {
    parts.service.events.reserve(count(deployment, "EVENT-DEPLOYMENTS"_tag, "SOMEIP-EVENT-DEPLOYMENT"_tag));
  }
  each_in(&deployment, "EVENT-DEPLOYMENTS"_tag, "SOMEIP-EVENT-DEPLOYMENT"_tag, [&](const Node& node) {
    const Node* reference = node.child("EVENT-REF"_tag);
    reference = reference == nullptr ? node.child("TRIGGER-REF"_tag) : reference;
    Event* event = nullptr;
    if (with_interface) {
      const auto found = parts.events.find(reference == nullptr ? nullptr : tree_.resolve(*reference));
      if (found == parts.events.end()) {
        problems_.warning(node.place(), Tree::path(&node) +
                                            " is of an event that its interface does not have; "
                                            "it is left out");
        return;
      }
      event = found->second;
    } else {
      event = added(parts.service.events, node);
      if (reference != nullptr) {
        event->name = reference->text.substr(reference->text.rfind('/') + 1);
      }
    }
    const Node* const id = node.child("EVENT-ID"_tag);
    const std::size_t before = changed;
    Place id_place;
    if (const auto value = event_id(id, changed, id_place)) {
      if (event->id && *event->id != *value) {
        problems_.warning(id->place(), Tree::path(&node) + ": the event has the id " +
                                           hex(someip::value(*event->id)) +
                                           " as well, which was read before");
      } else {
        event->id = value;
        event->id_place = id_place;
      }
    }
    first = first == nullptr && changed > before ? id : first;
    read_transfer(node, "MAXIMUM-SEGMENT-LENGTH"_tag, "SEPARATION-TIME"_tag, event->transfer);
    parts.events[&node] = event;
  });
  each_in(&deployment, "FIELD-DEPLOYMENTS"_tag, "SOMEIP-FIELD-DEPLOYMENT"_tag, [&](const Node& node) {
    const auto field = parts.fields.find(&node);
    const Node* const notifier = node.child("NOTIFIER"_tag);
    if (field == parts.fields.end() || notifier == nullptr) {
      return;
    }
    const std::size_t before = changed;
    field->second->notifier =
        event_id(notifier->child("EVENT-ID"_tag), changed, field->second->notifier_place);
    first = first == nullptr && changed > before ? notifier->child("EVENT-ID"_tag) : first;
  });
  if (changed > 0) {
    problems_.warning(first->place(),
                      std::to_string(changed) + " event ids of " + Tree::path(&deployment) +
                          " are below 0x8000: they get bit 15, as events have it on the wire");
  }
}

void Adaptive::read_methods(const Node& deployment, Parts& parts, bool with_interface) {
  if (!with_interface) {
    parts.service.methods.reserve(
        count(deployment, "METHOD-DEPLOYMENTS"_tag, "SOMEIP-METHOD-DEPLOYMENT"_tag));
  }
  each_in(&deployment, "METHOD-DEPLOYMENTS"_tag, "SOMEIP-METHOD-DEPLOYMENT"_tag, [&](const Node& node) {
    const Node* const reference = node.child("METHOD-REF"_tag);
    Method* method = nullptr;
    if (with_interface) {
      const auto found = parts.methods.find(reference == nullptr ? nullptr : tree_.resolve(*reference));
      if (found == parts.methods.end()) {
        problems_.warning(node.place(), Tree::path(&node) +
                                            " is of a method that its interface does not have; "
                                            "it is left out");
        return;
      }
      method = found->second;
    } else {
      method = added(parts.service.methods, node);
      if (reference != nullptr) {
        method->name = reference->text.substr(reference->text.rfind('/') + 1);
      }
    }
    method->id = method_id(node.child("METHOD-ID"_tag), method->id_place);
    read_transfer(node, "MAXIMUM-SEGMENT-LENGTH-REQUEST"_tag, "SEPARATION-TIME-REQUEST"_tag,
                  method->request_transfer);
    read_transfer(node, "MAXIMUM-SEGMENT-LENGTH-RESPONSE"_tag, "SEPARATION-TIME-RESPONSE"_tag,
                  method->response_transfer);
    parts.methods[&node] = method;
  });
}

void Adaptive::read_fields(const Node& deployment, Parts& parts, bool with_interface) {
  if (!with_interface) {
    parts.service.fields.reserve(count(deployment, "FIELD-DEPLOYMENTS"_tag, "SOMEIP-FIELD-DEPLOYMENT"_tag));
  }
  each_in(&deployment, "FIELD-DEPLOYMENTS"_tag, "SOMEIP-FIELD-DEPLOYMENT"_tag, [&](const Node& node) {
    const Node* const reference = node.child("FIELD-REF"_tag);
    Field* field = nullptr;
    const auto part = [&](Tag tag, Tag other) {
      const Node* const found = node.child(tag);
      const Node* const misspelt = found == nullptr ? node.child(other) : nullptr;
      if (misspelt != nullptr) {
        problems_.warning(misspelt->place(), std::string{to_string(other)} + " is read as " +
                                                 std::string{to_string(tag)} + ", which was expected");
      }
      return found == nullptr ? misspelt : found;
    };
    const Node* const getter = part("GET"_tag, "GETTER"_tag);
    const Node* const setter = part("SET"_tag, "SETTER"_tag);
    const Node* const notifier = node.child("NOTIFIER"_tag);
    if (with_interface) {
      const auto found = parts.fields.find(reference == nullptr ? nullptr : tree_.resolve(*reference));
      if (found == parts.fields.end()) {
        problems_.warning(node.place(), Tree::path(&node) +
                                            " is of a field that its interface does not have; "
                                            "it is left out");
        return;
      }
      field = found->second;
    } else {
      field = added(parts.service.fields, node);
      if (reference != nullptr) {
        field->name = reference->text.substr(reference->text.rfind('/') + 1);
      }
      field->has_getter = getter != nullptr;
      field->has_setter = setter != nullptr;
      field->has_notifier = notifier != nullptr;
    }
    parts.fields[&node] = field;
    if (getter != nullptr) {
      field->getter = method_id(getter->child("METHOD-ID"_tag), field->getter_place);
      read_transfer(*getter, "MAXIMUM-SEGMENT-LENGTH-RESPONSE"_tag, "SEPARATION-TIME-RESPONSE"_tag,
                    field->getter_transfer);
      parts.calls[getter] = &field->getter_e2e;
    }
    if (setter != nullptr) {
      field->setter = method_id(setter->child("METHOD-ID"_tag), field->setter_place);
      read_transfer(*setter, "MAXIMUM-SEGMENT-LENGTH-REQUEST"_tag, "SEPARATION-TIME-REQUEST"_tag,
                    field->setter_transfer);
      parts.calls[setter] = &field->setter_e2e;
    }
    if (notifier != nullptr) {
      read_transfer(*notifier, "MAXIMUM-SEGMENT-LENGTH"_tag, "SEPARATION-TIME"_tag, field->notifier_transfer);
      parts.fields[notifier] = field;
    }
  });
}

void Adaptive::read_eventgroups(const Node& deployment, Parts& parts) {
  const auto read_group = [&](const Node& node) {
    const auto number = number_in(node.child("EVENT-GROUP-ID"_tag), 0, 0xffff, problems_);
    if (!number) {
      problems_.warning(node.place(), Tree::path(&node) + " has no EVENT-GROUP-ID; it is left out");
      return;
    }
    const auto id = static_cast<someip::EventgroupId>(*number);
    parts.service.eventgroups.push_back({.name = std::string{node.name}, .id = id, .place = node.place()});
    each_in(&node, "EVENT-REFS"_tag, "EVENT-REF"_tag, [&](const Node& reference) {
      const Node* target = tree_.resolve(reference);
      if (target == nullptr && reference.text.rfind('/') > 0) {
        // …/Field/Notifier, while the notifier has another name.
        Node shorter = reference;
        shorter.text = reference.text.substr(0, reference.text.rfind('/'));
        target = shorter.text.empty() ? nullptr : tree_.resolve(shorter);
      }
      if (const auto event = parts.events.find(target); event != parts.events.end()) {
        event->second->eventgroups.push_back(id);
      } else if (const auto field = parts.fields.find(target); field != parts.fields.end()) {
        field->second->eventgroups.push_back(id);
      } else {
        problems_.warning(reference.place(),
                          "\"" + std::string{reference.text} + "\" is no event or notifier of this service");
      }
    });
  };
  each_in(&deployment, "EVENT-GROUPS"_tag, "SOMEIP-EVENT-GROUP"_tag, read_group);
  each_child(&deployment, "EVENT-GROUP-DEPLOYMENTS"_tag, [&](const Node& list) {
    problems_.warning(list.place(), "EVENT-GROUP-DEPLOYMENTS is read as EVENT-GROUPS, which was expected");
    each_child(&list, "SOMEIP-EVENT-GROUP"_tag, read_group);
  });
}

}  // namespace trestle::describe::arxml
