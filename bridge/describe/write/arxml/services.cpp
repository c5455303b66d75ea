#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

#include "bridge/describe/collecting.hpp"
#include "bridge/describe/layout.hpp"
#include "bridge/describe/member_names.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/describe/write/arxml/writer.hpp"

namespace trestle::describe::arxml_writer {

namespace {

[[nodiscard]] std::string number(std::uint32_t value) {
  return std::to_string(value);
}

/// A word as C++ has them, of which namespaces are made.
[[nodiscard]] bool is_symbol(std::string_view text) {
  return !text.empty() && (text.front() < '0' || text.front() > '9') && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

std::string Names::take(const std::string& name) {
  if (taken_.insert(name).second) {
    return name;
  }
  unsigned& number = next_.try_emplace(name, 2U).first->second;
  for (;; ++number) {
    std::string unique = name + (name.ends_with('_') ? "" : "_") + std::to_string(number);
    if (taken_.insert(unique).second) {
      return unique;
    }
  }
}

std::string seconds(std::chrono::nanoseconds time) {
  std::string fraction = std::to_string(time.count() % 1'000'000'000);
  fraction.insert(0, 9 - fraction.size(), '0');
  while (!fraction.empty() && fraction.back() == '0') {
    fraction.pop_back();
  }
  const std::string whole = std::to_string(time.count() / 1'000'000'000);
  return fraction.empty() ? whole : whole + "." + fraction;
}

void Writer::notes(Xml& xml, const Notes& notes, std::string_view category) {
  if (!notes.description.empty()) {
    xml.open("DESC");
    xml.leaf("L-2 L=\"EN\"", notes.description);
    xml.close();
  }
  if (!category.empty()) {
    xml.leaf("CATEGORY", category);
  }
  if (notes.others.empty() && notes.unit.empty()) {
    return;
  }
  xml.open("ANNOTATIONS");
  const auto annotation = [&](const std::string& label, const std::string& text) {
    xml.open("ANNOTATION");
    xml.open("LABEL");
    xml.leaf("L-4 L=\"EN\"", label);
    xml.close();
    xml.open("ANNOTATION-TEXT");
    xml.open("VERBATIM");
    xml.leaf("L-5 L=\"EN\" xml:space=\"preserve\"", text);
    xml.close();
    xml.close();
    xml.close();
  };
  if (!notes.unit.empty()) {
    annotation("unit", notes.unit);
  }
  for (const auto& [label, text] : notes.others) {
    annotation(label, text);
  }
  xml.close();
}

void Writer::check_payload(const std::string& element, const Payload& payload, Place place) {
  if (!payload.known) {
    lost(element, "that its payload is not known: it is written as empty", place);
  }
  if (payload.crc_bytes > 0) {
    lost(element, "its CRC of " + number(payload.crc_bytes) + (payload.crc_bytes == 1 ? " byte" : " bytes"),
         place);
  }
  if (payload.byte_order == std::endian::little && !payload.length_fields_always_big &&
      has_length_fields(model_, payload)) {
    lost(element, "that its length fields are little endian", place);
  }
}

std::string Writer::write_event(Xml& xml, const Service& service, const Event& event,
                                const std::string& service_path, const std::string& name) {
  const std::string element = service.name + "." + event.name;
  Notes beside = event.notes;
  std::string type;
  Value whole;
  if (event.payload.values.size() == 1 && !event.payload.values[0].tag) {
    const Value& value = event.payload.values[0];
    type = path_of(value);
    if (value.name != event.name) {
      beside.others["argument"] = value.name;
    }
    if (!value.notes.description.empty()) {
      lost(element, "the description of its argument", value.place);
    }
    if (!value.notes.unit.empty()) {
      beside.unit = value.notes.unit;
    }
  } else if (!event.payload.values.empty()) {
    const std::string package = std::string{own} + "/Arguments";
    const std::string unique = packages_.unique(package, service.name + "_" + event.name);
    type = package + "/" + unique;
    Xml structure;
    structure.open("STD-CPP-IMPLEMENTATION-DATA-TYPE");
    structure.leaf("SHORT-NAME", unique);
    structure.leaf("CATEGORY", "STRUCTURE");
    write_members(structure, event.payload.values, type);
    structure.close();
    packages_.add(package, unique, structure.text());
  }
  xml.open(type.empty() ? "TRIGGER" : "VARIABLE-DATA-PROTOTYPE");
  xml.leaf("SHORT-NAME", name);
  notes(xml, beside);
  if (!type.empty()) {
    xml.reference("TYPE-TREF", "STD-CPP-IMPLEMENTATION-DATA-TYPE", type);
  }
  xml.close();
  check_payload(element, event.payload, event.place);
  if (type.empty()) {
    return type;
  }
  std::vector<std::pair<Prototype, const Value*>> values;
  const Prototype root{service_path + "/" + name, "VARIABLE-DATA-PROTOTYPE"};
  if (event.payload.values.size() == 1 && !event.payload.values[0].tag) {
    values.emplace_back(root, &event.payload.values[0]);
    write_wire(service, service_path, name, "EVENT-REFS", "EVENT-REF", "VARIABLE-DATA-PROTOTYPE", values,
               event.payload);
  } else {
    // Rules of an argument are those of a member of the structure around all of them.
    root_ = root;
    for (const Value& value : event.payload.values) {
      values.emplace_back(
          Prototype{type + "/" + members_[{type, value.name}], "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT"},
          &value);
    }
    write_wire(service, service_path, name, "EVENT-REFS", "EVENT-REF", "VARIABLE-DATA-PROTOTYPE", values,
               event.payload);
    root_.reset();
  }
  return type;
}

void Writer::write_application_error(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string package = package_of(slash == std::string::npos ? std::string{} : path.substr(0, slash));
  const std::string name = short_name(slash == std::string::npos ? path : path.substr(slash + 1));
  if (packages_.has(package, name)) {
    return;
  }
  const std::string domains = std::string{own} + "/Errors";
  if (!packages_.has(domains, "Domain")) {
    Xml domain;
    domain.open("AP-APPLICATION-ERROR-DOMAIN");
    domain.leaf("SHORT-NAME", "Domain");
    domain.leaf("VALUE", "1");
    domain.close();
    packages_.add(domains, "Domain", domain.text());
  }
  Xml xml;
  xml.open("AP-APPLICATION-ERROR");
  xml.leaf("SHORT-NAME", name);
  xml.leaf("ERROR-CODE", number(++errors_));
  xml.reference("ERROR-DOMAIN-REF", "AP-APPLICATION-ERROR-DOMAIN", domains + "/Domain");
  xml.close();
  packages_.add(package, name, xml.text());
}

void Writer::write_method(Xml& xml, const Service& service, const Method& method,
                          const std::string& service_path, const std::string& name) {
  const std::string element = service.name + "." + method.name;
  xml.open("CLIENT-SERVER-OPERATION");
  xml.leaf("SHORT-NAME", name);
  notes(xml, method.notes);
  std::vector<std::pair<Prototype, const Value*>> values;
  Names names;
  bool opened = false;
  const auto argument = [&](const Value& value, const char* direction) {
    if (!opened) {
      xml.open("ARGUMENTS");
      opened = true;
    }
    const std::string unique = names.take(short_name(value.name));
    if (unique != value.name) {
      lost(element + "." + value.name, "its name: it is " + unique, value.place);
    }
    xml.open("ARGUMENT-DATA-PROTOTYPE");
    xml.leaf("SHORT-NAME", unique);
    notes(xml, value.notes);
    xml.reference("TYPE-TREF", "STD-CPP-IMPLEMENTATION-DATA-TYPE", path_of(value));
    xml.leaf("DIRECTION", direction);
    xml.close();
    const std::string path = service_path + "/" + name + "/" + unique;
    write_tag(value.tag, "TLV-ARGUMENT-REF", "ARGUMENT-DATA-PROTOTYPE", path);
    values.emplace_back(Prototype{path, "ARGUMENT-DATA-PROTOTYPE"}, &value);
  };
  std::set<std::string> inout(method.inout.begin(), method.inout.end());
  const auto is_inout = [&](const Value& value) { return inout.contains(value.name); };
  const auto inout_of = [&](const Payload& payload) {
    std::vector<std::string> all;
    for (const Value& value : payload.values) {
      if (is_inout(value)) {
        all.push_back(value.name);
      }
    }
    return all;
  };
  if (inout_of(method.request) != inout_of(method.response)) {
    inout.clear();
    lost(element, "that arguments are INOUT, which are not all in its answer in this order", method.place);
  }
  Value error;
  const auto write_error = [&] {
    if (method.error != no_type && error.type == no_type) {
      error.name = "error";
      error.type = method.error;
      error.wire = model_.at(method.error).wire;
      argument(error, "OUT");
      lost(element, "that its first argument out is an error", method.place);
    }
  };
  // The answer has its arguments in this order, too: those out stand before the INOUT that they precede
  // there.
  auto out = method.response.values.begin();
  const auto write_out = [&](auto end) {
    for (; out != end; ++out) {
      if (!is_inout(*out)) {
        argument(*out, "OUT");
      }
    }
  };
  for (const Value& value : method.request.values) {
    if (is_inout(value)) {
      write_error();
      write_out(std::find_if(out, method.response.values.end(),
                             [&](const Value& other) { return other.name == value.name; }));
    }
    argument(value, is_inout(value) ? "INOUT" : "IN");
  }
  write_error();
  write_out(method.response.values.end());
  if (opened) {
    xml.close();
  }
  if (method.fire_and_forget) {
    xml.leaf("FIRE-AND-FORGET", "true");
  }
  if (!method.application_errors.empty()) {
    xml.open("POSSIBLE-AP-ERROR-REFS");
    for (const std::string& path : method.application_errors) {
      write_application_error(path);
      xml.reference("POSSIBLE-AP-ERROR-REF", "AP-APPLICATION-ERROR", path);
    }
    xml.close();
    lost(element, "the codes of its application errors", method.place);
  }
  xml.close();
  check_payload(element, method.request, method.place);
  check_payload(element, method.response, method.place);
  const bool no_answer = method.response.values.empty();
  if (!no_answer && (method.request.byte_order != method.response.byte_order ||
                     method.request.alignment != method.response.alignment)) {
    lost(element, "that its response has another byte order or alignment than its request", method.place);
  }
  write_wire(service, service_path, name, "METHOD-REFS", "METHOD-REF", "CLIENT-SERVER-OPERATION", values,
             method.request.values.empty() && !no_answer ? method.response : method.request);
  if (method.timeout) {
    lost(element, "its timeout", method.place);
  }
  if (!method.selector.empty()) {
    lost(element, "its selector " + method.selector, method.place);
  }
}

void Writer::write_transfer(Xml& xml, const Transfer& transfer, const std::string& element,
                            const Place& place) {
  xml.leaf("TRANSPORT-PROTOCOL", transfer.transport == Transport::tcp ? "TCP" : "UDP");
  if (transfer.segment_bytes % 16 != 0) {
    lost(element,
         "segments of " + number(transfer.segment_bytes) + " bytes: readers make it a multiple of 16, " +
             number(transfer.segment_bytes / 16 * 16),
         place);
  }
  collecting_times(transfer, element, place);
}

void Writer::collecting_times(const Transfer& transfer, const std::string& element, const Place& place) {
  // CommonAPI's time where nobody wrote another one is told once of a service, not of each of its members.
  if (is_usual_collecting(transfer)) {
    has_usual_times_ = true;
  } else if (is_collected(transfer)) {
    lost(element, "its times of collecting several messages", place);
  }
}

void Writer::write_service(const Service& service) {
  const std::string package = package_of(service.scope);
  const std::string& service_name = service_names_.at(&service);
  if (service_name != service.name) {
    lost(full_name(service.scope, service.name), "its name: it is " + service_name, service.place);
  }
  if (service.scope.empty() && !has_made_name(service)) {
    lost(service.name, "that it has no package: it is in " + package.substr(1), service.place);
  }
  const std::string path = package + "/" + service_name;
  const std::string full = full_name(service.scope, service.name);
  std::map<std::string, std::string>& names = member_names_[full];
  Names taken;
  const auto name_of = [&](const std::string& name, const std::string& selector, const Place& place) {
    std::string unique = taken.take(short_name(name));
    if (unique != name) {
      lost(service.name + "." + member_key(name, selector), "its name: it is " + unique, place);
    }
    return unique;
  };
  Xml xml;
  xml.open("SERVICE-INTERFACE");
  xml.leaf("SHORT-NAME", service_name);
  notes(xml, service.notes);
  std::vector<std::string> spaces;
  for (const std::string& space : service.namespaces) {
    if (is_symbol(space)) {
      spaces.push_back(space);
    } else {
      lost(full_name(service.scope, service.name), "its namespace: " + space + " is none for AUTOSAR",
           service.place);
    }
  }
  if (!spaces.empty()) {
    xml.open("NAMESPACES");
    std::size_t index = 0;
    for (const std::string& space : spaces) {
      xml.open("SYMBOL-PROPS");
      xml.leaf("SHORT-NAME", "ns" + std::to_string(++index));
      xml.leaf("SYMBOL", space);
      xml.close();
    }
    xml.close();
  }
  if (service.has_version) {
    xml.leaf("MAJOR-VERSION", number(service.major));
    xml.leaf("MINOR-VERSION", number(service.minor));
  }
  Xml triggers;
  Xml events;
  for (const Event& event : service.events) {
    const std::string name = names["event " + member_key(event.name, event.selector)] =
        name_of(event.name, event.selector, event.place);
    Xml one;
    const bool is_trigger = write_event(one, service, event, path, name).empty();
    (is_trigger ? triggers : events).raw(one.text());
    if (is_trigger) {
      names["trigger " + member_key(event.name, event.selector)] = name;
    }
    if (event.selective) {
      lost(service.name + "." + event.name, "that it is selective", event.place);
    }
    if (!event.selector.empty()) {
      lost(service.name + "." + event.name, "its selector " + event.selector, event.place);
    }
    if (event.cycle) {
      lost(service.name + "." + event.name, "its cycle", event.place);
    }
  }
  const auto list = [&](const char* tag, const std::string& text) {
    if (!text.empty()) {
      xml.open(tag);
      xml.raw(text);
      xml.close();
    }
  };
  list("EVENTS", events.text());
  Xml fields;
  for (const Field& field : service.fields) {
    const std::string name = names["field " + field.name] = name_of(field.name, {}, field.place);
    const std::string element = service.name + "." + field.name;
    if (field.payload.values.size() != 1) {
      lost(element, "the field: its type is not known", field.place);
      names.erase("field " + field.name);
      continue;
    }
    const Value& value = field.payload.values[0];
    Notes beside = field.notes;
    if (beside.unit.empty()) {
      beside.unit = value.notes.unit;
    }
    fields.open("FIELD");
    fields.leaf("SHORT-NAME", name);
    notes(fields, beside);
    fields.reference("TYPE-TREF", "STD-CPP-IMPLEMENTATION-DATA-TYPE", path_of(value));
    fields.leaf("HAS-GETTER", field.has_getter ? "true" : "false");
    fields.leaf("HAS-NOTIFIER", field.has_notifier ? "true" : "false");
    fields.leaf("HAS-SETTER", field.has_setter ? "true" : "false");
    fields.close();
    check_payload(element, field.payload, field.place);
    write_wire(service, path, name, "FIELD-REFS", "FIELD-REF", "FIELD",
               {{Prototype{path + "/" + name, "FIELD"}, &value}}, field.payload);
    if (field.cycle) {
      lost(element, "its cycle", field.place);
    }
  }
  list("FIELDS", fields.text());
  Xml methods;
  for (const Method& method : service.methods) {
    const std::string name = names["method " + member_key(method.name, method.selector)] =
        name_of(method.name, method.selector, method.place);
    write_method(methods, service, method, path, name);
  }
  list("METHODS", methods.text());
  list("TRIGGERS", triggers.text());
  xml.close();
  packages_.add(package, service_name, xml.text());
  if (!service.base.empty()) {
    lost(full, "that it extends " + service.base + ": its members are copied in", service.place);
  }
  for (const std::string& managed : service.manages) {
    lost(full, "that it manages " + managed, service.place);
  }
  write_deployment(service, path);
}

void Writer::write_deployment(const Service& service, const std::string& service_path) {
  const std::string full = full_name(service.scope, service.name);
  const std::string package = std::string{own} + "/Deployment";
  if (!service.id && service.eventgroups.empty() && !services_with_instances_.contains(full)) {
    note_protections(service, {});
    return;
  }
  const std::string name = packages_.unique(package, service.name + "_Someip");
  const std::string path = package + "/" + name;
  deployments_[full] = path;
  note_protections(service, path);
  const std::map<std::string, std::string>& names = member_names_[full];
  std::map<someip::EventgroupId, std::vector<std::string>> groups;
  const auto transfer = [&](Xml& xml, const Transfer& what, const char* suffix) {
    if (what.segment_bytes > 0) {
      xml.leaf(std::string{"MAXIMUM-SEGMENT-LENGTH"} + suffix, number(what.segment_bytes + 12));
    }
  };
  const auto separation = [&](Xml& xml, const Transfer& what, const char* suffix) {
    if (what.separation.count() > 0) {
      xml.leaf(std::string{"SEPARATION-TIME"} + suffix, seconds(what.separation));
    }
  };
  const auto has_event_bit = [&](const std::string& element, const std::optional<someip::MethodId>& id,
                                 const Place& place) {
    if (id && someip::value(*id) < 0x8000) {
      lost(element, "that its id has no bit 15: readers set it", place);
    }
  };
  // Ids of events as readers have them: those that have bit 15 already stay as they are.
  std::set<someip::MethodId> sent;
  const auto note = [&sent](const std::optional<someip::MethodId>& id) {
    if (id && someip::value(*id) >= 0x8000) {
      sent.insert(*id);
    }
  };
  for (const Event& event : service.events) {
    note(event.id);
  }
  for (const Field& field : service.fields) {
    note(field.notifier);
  }
  const auto is_free = [&](const std::string& element, someip::MethodId id, const Place& place) {
    if (someip::value(id) >= 0x8000 || sent.insert(someip::MethodId(someip::value(id) | 0x8000U)).second) {
      return true;
    }
    lost(element, "its id, which with bit 15 is that of another one: " + number(someip::value(id)), place);
    return false;
  };
  Xml events;
  for (const Event& event : service.events) {
    const std::string& short_one = names.at("event " + member_key(event.name, event.selector));
    const bool is_trigger = names.contains("trigger " + member_key(event.name, event.selector));
    events.open("SOMEIP-EVENT-DEPLOYMENT");
    events.leaf("SHORT-NAME", short_one);
    events.reference(is_trigger ? "TRIGGER-REF" : "EVENT-REF",
                     is_trigger ? "TRIGGER" : "VARIABLE-DATA-PROTOTYPE", service_path + "/" + short_one);
    if (event.id && is_free(service.name + "." + event.name, *event.id, event.place)) {
      note_chosen(events, service.chosen_ids.contains(*event.id));
      events.leaf("EVENT-ID", number(someip::value(*event.id)));
    }
    transfer(events, event.transfer, "");
    separation(events, event.transfer, "");
    write_transfer(events, event.transfer, service.name + "." + event.name, event.place);
    events.close();
    for (const someip::EventgroupId group : event.eventgroups) {
      groups[group].push_back(path + "/" + short_one);
    }
    has_event_bit(service.name + "." + event.name, event.id, event.place);
  }
  Xml methods;
  for (const Method& method : service.methods) {
    const std::string& short_one = names.at("method " + member_key(method.name, method.selector));
    methods.open("SOMEIP-METHOD-DEPLOYMENT");
    methods.leaf("SHORT-NAME", short_one);
    methods.reference("METHOD-REF", "CLIENT-SERVER-OPERATION", service_path + "/" + short_one);
    transfer(methods, method.request_transfer, "-REQUEST");
    transfer(methods, method.response_transfer, "-RESPONSE");
    if (method.id && someip::value(*method.id) == 0) {
      lost(service.name + "." + method.name, "its id 0, which is reserved: readers take it for none",
           method.place);
    }
    if (method.id) {
      note_chosen(methods, service.chosen_ids.contains(*method.id));
      methods.leaf("METHOD-ID", number(someip::value(*method.id)));
    }
    separation(methods, method.request_transfer, "-REQUEST");
    separation(methods, method.response_transfer, "-RESPONSE");
    write_transfer(methods, method.request_transfer, service.name + "." + method.name, method.place);
    if (method.response_transfer.debounce != method.request_transfer.debounce ||
        method.response_transfer.retention != method.request_transfer.retention) {
      collecting_times(method.response_transfer, service.name + "." + method.name + " (answer)",
                       method.place);
    }
    if (!method.fire_and_forget && method.response_transfer.transport != method.request_transfer.transport) {
      lost(service.name + "." + method.name, "that its response has another transport than its request",
           method.place);
    }
    methods.close();
  }
  Xml fields;
  for (const Field& field : service.fields) {
    const auto found = names.find("field " + field.name);
    if (found == names.end()) {
      continue;
    }
    const std::string& short_one = found->second;
    fields.open("SOMEIP-FIELD-DEPLOYMENT");
    fields.leaf("SHORT-NAME", short_one);
    fields.reference("FIELD-REF", "FIELD", service_path + "/" + short_one);
    const auto part = [&](const char* tag, const char* part_name, bool there,
                          const std::optional<someip::MethodId>& id, const Transfer& what,
                          const char* suffix) {
      if (!there) {
        return;
      }
      fields.open(tag);
      fields.leaf("SHORT-NAME", part_name);
      const bool is_event = suffix[0] == '\0';
      if (is_event && id && is_free(service.name + "." + field.name, *id, field.place)) {
        note_chosen(fields, service.chosen_ids.contains(*id));
        fields.leaf("EVENT-ID", number(someip::value(*id)));
      }
      transfer(fields, what, suffix);
      if (!is_event && id) {
        note_chosen(fields, service.chosen_ids.contains(*id));
        fields.leaf("METHOD-ID", number(someip::value(*id)));
      }
      separation(fields, what, suffix);
      write_transfer(fields, what, service.name + "." + field.name + "." + part_name, field.place);
      fields.close();
    };
    part("GET", "get", field.has_getter, field.getter, field.getter_transfer, "-RESPONSE");
    part("NOTIFIER", "notify", field.has_notifier, field.notifier, field.notifier_transfer, "");
    if (field.has_notifier) {
      has_event_bit(service.name + "." + field.name, field.notifier, field.place);
    }
    part("SET", "set", field.has_setter, field.setter, field.setter_transfer, "-REQUEST");
    fields.close();
    if (field.has_notifier) {
      for (const someip::EventgroupId group : field.eventgroups) {
        groups[group].push_back(path + "/" + short_one + "/notify");
      }
    }
  }
  Xml xml;
  xml.open("SOMEIP-SERVICE-INTERFACE-DEPLOYMENT");
  xml.leaf("SHORT-NAME", name);
  const auto list = [&](const char* tag, const std::string& text) {
    if (!text.empty()) {
      xml.open(tag);
      xml.raw(text);
      xml.close();
    }
  };
  list("EVENT-DEPLOYMENTS", events.text());
  list("FIELD-DEPLOYMENTS", fields.text());
  list("METHOD-DEPLOYMENTS", methods.text());
  xml.reference("SERVICE-INTERFACE-REF", "SERVICE-INTERFACE", service_path);
  std::map<someip::EventgroupId, std::string> group_names;
  for (const Eventgroup& group : service.eventgroups) {
    group_names[group.id] = group.name;
  }
  for (const auto& [id, members] : groups) {
    group_names.try_emplace(id);
  }
  if (!group_names.empty()) {
    const auto has_no_name = [](const auto& group) { return group.second.empty(); };
    if (std::ranges::any_of(group_names, has_no_name) && !has_made_name(service)) {
      lost(full, "that eventgroups of it have no names: they are Eventgroup_ and their ids", service.place);
    }
    xml.open("EVENT-GROUPS");
    Names taken;
    for (const auto& [member, short_one] : names) {
      taken.insert(short_one);
    }
    for (const auto& [id, group_name] : group_names) {
      const std::string unique =
          taken.take(group_name.empty() ? "Eventgroup_" + number(someip::value(id)) : short_name(group_name));
      if (!group_name.empty() && unique != group_name) {
        lost(service.name + "." + group_name, "its name: it is " + unique, service.place);
      }
      xml.open("SOMEIP-EVENT-GROUP");
      xml.leaf("SHORT-NAME", unique);
      const auto group = std::ranges::find(service.eventgroups, id, &Eventgroup::id);
      note_chosen(xml, group != service.eventgroups.end() && group->id_is_chosen);
      xml.leaf("EVENT-GROUP-ID", number(someip::value(id)));
      if (const auto members = groups.find(id); members != groups.end()) {
        xml.open("EVENT-REFS");
        for (const std::string& member : members->second) {
          xml.reference("EVENT-REF", "SOMEIP-EVENT-DEPLOYMENT", member);
        }
        xml.close();
      }
      xml.close();
      eventgroups_[{full, someip::value(id)}] = path + "/" + unique;
    }
    xml.close();
  }
  if (service.id) {
    note_chosen(xml, service.id_is_chosen);
    xml.leaf("SERVICE-INTERFACE-ID", number(someip::value(*service.id)));
  }
  if (service.has_version) {
    xml.open("SERVICE-INTERFACE-VERSION");
    xml.leaf("MAJOR-VERSION", number(service.major));
    xml.leaf("MINOR-VERSION", number(service.minor));
    xml.close();
  }
  xml.close();
  packages_.add(package, name, xml.text());
  if (std::exchange(has_usual_times_, false)) {
    lost(full, std::string{usual_collecting}, service.place);
  }
}

ArxmlFile Writer::write() {
  for (const Instance& instance : model_.instances) {
    services_with_instances_.insert(instance.service);
  }
  // Services have their names first: packages of types give way.
  for (const Service& service : model_.services) {
    const std::string package = package_of(service.scope);
    service_names_[&service] = packages_.unique(package, service.name);
    service_paths_.insert(package + "/" + service_names_[&service]);
  }
  group_variants();
  write_types();
  for (const Service& service : model_.services) {
    write_service(service);
  }
  write_instances();
  list_unwritten_protections();
  write_profiles();
  write_rules();
  write_tags();
  std::set<std::string_view> of_ros;
  for (const Type& type : model_.types) {
    if (const std::string_view name = ros_only_name(type); !name.empty() && of_ros.insert(name).second) {
      lost(
          std::string{name},
          std::string{"a type of ROS: it is "} + (type.kind == Kind::string ? "a string" : "uint8") + " here",
          type.place);
    }
  }
  for (const Constant& constant : model_.constants) {
    lost(full_name(constant.scope, constant.name), "the constant", constant.place);
  }
  for (const TypeCollection& collection : model_.collections) {
    lost(collection.scope, "the version and the description of its type collection", collection.place);
  }
  file_.text = packages_.text();
  return std::move(file_);
}

}  // namespace trestle::describe::arxml_writer

namespace trestle::describe {

ArxmlFile write_arxml(const Model& model) {
  return arxml_writer::Writer{model}.write();
}

}  // namespace trestle::describe
