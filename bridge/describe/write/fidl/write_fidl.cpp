#include "bridge/describe/write/fidl/write_fidl.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "bridge/describe/ros_names.hpp"
#include "bridge/describe/write/fidl/deployment.hpp"
#include "bridge/describe/write/fidl/enumerations.hpp"
#include "bridge/describe/write/fidl/unions.hpp"

namespace trestle::describe {
namespace fidl_writing {
namespace {

/// What cannot stand in an annotation as it is.
std::string annotation_text(std::string_view text, const std::string& margin) {
  std::string result;
  for (const char c : text) {
    if (c == '\n') {
      result += "\n" + margin + "    ";
    } else {
      result += c == '@' || c == '*' || c == '\\' ? "\\" : "";
      result += c;
    }
  }
  return result;
}

bool is_known_annotation(std::string_view name) {
  return std::ranges::any_of(
      std::initializer_list<std::string_view>{"@experimental", "@deprecated", "@author", "@source-uri",
                                              "@source-alias", "@see", "@param", "@details", "@high-volume",
                                              "@high-frequency"},
      [&](std::string_view known) { return known == name; });
}

class Writer {
 public:
  explicit Writer(const Model& model) : model_{model}, plan_{model, result_.not_carried} {}

  Written all();

 private:
  void fidl(const std::string& package);
  void fdepl(const std::string& package);
  void container(std::string& text, const Container& container);
  void type(std::string& text, const Container& in, TypeIndex index);
  void attribute(std::string& text, const Container& in, const Field& field);
  void method(std::string& text, const Container& in, const Method& method);
  void event(std::string& text, const Container& in, const Event& event);
  /// A member or an argument.
  /// @param name  as FIDL has it
  /// @param is_inout  an argument out that is in, too
  void value(std::string& text, const Container& in, const Value& value, const std::string& name,
             const std::string& margin, const std::string& owner, bool is_inout = false);
  void arguments(std::string& text, const Container& in, const char* word, const std::vector<Value>& all,
                 const std::vector<std::string>& names, const std::string& owner,
                 const std::vector<std::string>& inout);
  void enumerators(std::string& text, TypeIndex type, const std::string& margin, const std::string& owner);
  /// @param told  what else the annotation has for the reader: "name: int"; empty: nothing
  /// @param element  what it is called in what is lost: "car.Door.open"
  void notes(std::string& text, const Notes& notes, const std::string& margin, const std::string& told,
             const std::string& element, Place place);
  /// "name: int", where that is not the name in the file.
  [[nodiscard]] static std::string told_name(const std::string& name, std::string_view written) {
    return name == written ? std::string{} : "name: " + name;
  }
  [[nodiscard]] std::string use(const Container& in, TypeIndex type) const {
    return plan_.reference(type, in) + (plan_.is_inline(plan_.root(type)) ? "[]" : "");
  }
  /// Packages whose files one of this package needs.
  [[nodiscard]] std::set<std::string> imports(const std::string& package) const;
  void reach(TypeIndex type, std::set<TypeIndex>& seen) const;
  void add_types_of(const Container& container, std::set<TypeIndex>& seen) const;
  /// Collections that a deployment of the service uses.
  [[nodiscard]] std::set<std::string> uses_of(const Container& container);
  [[nodiscard]] static std::string written_selector(const std::string& selector) {
    return selector.empty() ? "" : ":" + escaped(usable(selector, false));
  }
  /// Keys of other languages, as the scale of a number of AUTOSAR.
  void lose_keys(const Notes& notes, const std::string& element, Place place) {
    for (const auto& [key, value] : notes.others) {
      if (!key.starts_with('@')) {
        lose(element, fmt::format("{} = {}", key, value), place);
      }
    }
  }
  void lose_units_in(TypeIndex type, const std::string& element, Place place) {
    for (const Value* const part : {&model_.at(type).element, &model_.at(type).key}) {
      if (!part->notes.unit.empty()) {
        lose(element, fmt::format("the unit of its elements: {}", part->notes.unit), place);
      }
    }
  }
  /// Of a member, an argument or an attribute.
  void lose_notes(const Value& value, const std::string& element, Place place) {
    lose_keys(value.notes, element, place);
    if (plan_.is_inline(plan_.root(value.type))) {
      lose_units_in(value.type, element, place);
    }
  }
  void lose(const std::string& element, std::string what, Place place) {
    result_.not_carried.push_back({element, std::move(what), place});
  }

  const Model& model_;
  Written result_{};
  Plan plan_;
  std::map<std::string, std::vector<const Instance*>> providers_{};  ///< by package
  /// By container: whether its deployment says anything.
  std::map<std::size_t, bool> deployed_collections_{};
};

Written Writer::all() {
  for (const Instance& instance : model_.instances) {
    const Container* const service =
        instance.role == Instance::Role::required ? nullptr : plan_.service(instance.service);
    if (service != nullptr) {
      providers_[service->package].push_back(&instance);
    }
  }
  for (const std::string& package : plan_.packages()) {
    fidl(package);
    fdepl(package);
  }
  std::set<std::string_view> of_ros;
  for (std::size_t i = 0; i < model_.types.size(); ++i) {
    const TypeIndex index{static_cast<std::uint32_t>(i)};
    const Type& type = model_.types[i];
    if (const std::string_view name = ros_only_name(type); !name.empty() && of_ros.insert(name).second) {
      lose(std::string{name}, fmt::format("a type of ROS: it is {} here", basic_name(type)), type.place);
    }
    if (type.variant_of == no_type && plan_.is_inline(index) && !plan_.is_left_out(index)) {
      const std::string full = full_name(type.scope, type.name);
      lose_keys(type.notes, full, type.place);
      if (!type.notes.description.empty()) {
        lose(full, "the description of an array that is written as T[]", type.place);
      }
    }
  }
  for (const Machine& machine : model_.machines) {
    lose(machine.name.empty() ? "the machine" : machine.name, "a machine", machine.place);
  }
  for (const Instance& instance : model_.instances) {
    if (instance.role == Instance::Role::required) {
      lose(label_of(instance), "an instance that is used and not offered", instance.place);
    } else if (plan_.service(instance.service) == nullptr) {
      lose(label_of(instance), "an instance of a service that is not described", instance.place);
    }
  }
  return std::move(result_);
}

void Writer::reach(TypeIndex type, std::set<TypeIndex>& seen) const {
  std::vector<TypeIndex> open{type};
  while (!open.empty()) {
    const TypeIndex index = open.back();
    open.pop_back();
    if (index == no_type || !seen.insert(index).second) {
      continue;
    }
    const Type& it = model_.at(index);
    open.insert(open.end(), {it.base, it.element.type, it.key.type, it.variant_of});
    for (const Value& member : it.members) {
      open.push_back(member.type);
    }
  }
}

void Writer::add_types_of(const Container& container, std::set<TypeIndex>& seen) const {
  for (const TypeIndex type : container.types) {
    reach(type, seen);
  }
  for (const Constant* constant : container.constants) {
    reach(constant->type, seen);
  }
  if (container.service != nullptr) {
    const auto add = [&](const Payload& payload) {
      for (const Value& value : payload.values) {
        reach(value.type, seen);
      }
    };
    for (const Field& field : container.service->fields) {
      add(field.payload);
    }
    for (const Method& method : container.service->methods) {
      add(method.request);
      add(method.response);
      reach(method.error, seen);
    }
    for (const Event& event : container.service->events) {
      add(event.payload);
    }
  }
}

std::set<std::string> Writer::imports(const std::string& package) const {
  std::set<std::string> others;
  const auto add_service = [&](const std::string& full) {
    if (const Container* const other = plan_.service(full)) {
      others.insert(other->package);
    }
  };
  std::set<TypeIndex> types;
  for (const Container* const one : plan_.containers_of(package)) {
    const Container& container = *one;
    add_types_of(container, types);
    if (container.service != nullptr) {
      add_service(container.service->base);
      for (const std::string& managed : container.service->manages) {
        add_service(managed);
      }
    }
  }
  for (const TypeIndex type : types) {
    if (const Declared* declared = plan_.declared(type)) {
      others.insert(plan_.containers()[declared->container].package);
    }
  }
  others.erase(package);
  return others;
}

void Writer::fidl(const std::string& package) {
  std::string text = "package " + package + "\n";
  const std::set<std::string> others = imports(package);
  text += others.empty() ? "" : "\n";
  for (const std::string& other : others) {
    text += fmt::format("import model \"{}.fidl\"\n", other);
  }
  for (const Container* const one : plan_.containers_of(package)) {
    if (one->service != nullptr || one->collection != nullptr || !one->types.empty() ||
        !one->constants.empty()) {
      container(text, *one);
    }
  }
  result_.files.push_back({package + ".fidl", std::move(text)});
}

void Writer::notes(std::string& text, const Notes& notes, const std::string& margin, const std::string& told,
                   const std::string& element, Place place) {
  std::vector<std::string> lines;
  if (!notes.description.empty()) {
    lines.push_back("@description : " + annotation_text(notes.description, margin));
  }
  if (!told.empty()) {
    lines.push_back("@details : " + annotation_text(told, margin));
  }
  if (!notes.unit.empty()) {
    lines.push_back("@details : unit: " + annotation_text(notes.unit, margin));
  }
  for (const auto& [name, value] : notes.others) {
    if (is_known_annotation(name)) {
      lines.push_back(name + " : " + annotation_text(value, margin));
    } else if (name.starts_with('@')) {
      lose(element, fmt::format("the annotation {}, which Franca does not know", name), place);
    }
  }
  if (lines.empty()) {
    return;
  }
  text += margin + "<**";
  for (const std::string& line : lines) {
    text += (&line == &lines.front() ? " " : "\n" + margin + "    ") + line;
  }
  text += " **>\n";
}

void Writer::container(std::string& text, const Container& container) {
  const std::string margin = "    ";
  text += "\n";
  if (container.service == nullptr) {
    const TypeCollection plain{};
    const TypeCollection& collection = container.collection == nullptr ? plain : *container.collection;
    notes(text, collection.notes, "", "", container.full(), collection.place);
    text +=
        container.name.empty() ? "typeCollection {\n" : fmt::format("typeCollection {} {{\n", container.name);
    text += fmt::format("    version {{ major {} minor {} }}\n", collection.major, collection.minor);
  } else {
    const Service& service = *container.service;
    const std::string full = full_name(service.scope, service.name);
    notes(text, service.notes, "", told_name(service.name, container.name), full, service.place);
    text += "interface " + container.name;
    if (!service.base.empty()) {
      const std::string base = plan_.service_name(service.base);
      if (base.empty()) {
        lose(full, fmt::format("the interface {} that it extends, which is not described", service.base),
             service.place);
      } else {
        text += " extends " + base;
      }
    }
    std::string managed;
    for (const std::string& name : service.manages) {
      const std::string other = plan_.service_name(name);
      if (other.empty()) {
        lose(full, fmt::format("the interface {} that it manages, which is not described", name),
             service.place);
      } else {
        managed += (managed.empty() ? " manages " : ", ") + other;
      }
    }
    text += managed + fmt::format(" {{\n    version {{ major {} minor {} }}\n", service.major, service.minor);
    const Inherited inherited{plan_.service(service.base)};
    for (const Field& field : service.fields) {
      if (!inherited.fields.contains(field.name)) {
        attribute(text, container, field);
      }
    }
    for (const Method& one : service.methods) {
      if (!inherited.methods.contains(member_key(one.name, one.selector))) {
        method(text, container, one);
      }
    }
    for (const Event& one : service.events) {
      if (!inherited.events.contains(member_key(one.name, one.selector))) {
        event(text, container, one);
      }
    }
  }
  for (const Constant* constant : container.constants) {
    const std::string value = constant_value(model_, plan_, *constant, container);
    if (value.empty() || plan_.is_left_out(constant->type)) {
      lose(full_name(constant->scope, constant->name),
           fmt::format("the constant's value {}", constant->value), constant->place);
      continue;
    }
    if (!constant->scope.starts_with('/') && constant->scope.find('/') != std::string::npos) {
      lose(full_name(constant->scope, constant->name), "that it is a constant of a message of ROS",
           constant->place);
    }
    text += "\n";
    const std::string name = plan_.constant_name(*constant);
    notes(text, constant->notes, margin, told_name(constant->name, name),
          full_name(constant->scope, constant->name), constant->place);
    text += fmt::format("    const {} {} = {}\n", use(container, constant->type), escaped(name), value);
  }
  for (const TypeIndex index : container.types) {
    type(text, container, index);
  }
  text += "}\n";
}

void Writer::value(std::string& text, const Container& in, const Value& value, const std::string& name,
                   const std::string& margin, const std::string& owner, bool is_inout) {
  if (!plan_.is_left_out(value.type)) {
    const std::string element = owner + "." + value.name;
    notes(text, value.notes, margin, is_inout ? "inout: " + value.name : told_name(value.name, name), element,
          value.place);
    lose_notes(value, element, value.place);
    text += fmt::format("{}{} {}\n", margin, use(in, value.type), escaped(name));
  }
}

void Writer::enumerators(std::string& text, TypeIndex type, const std::string& margin,
                         const std::string& owner) {
  for (const Enumerator& one : model_.at(type).enumerators) {
    const std::string name = plan_.member_name(type, one.name);
    notes(text, one.notes, margin, told_name(one.name, name), owner + "." + one.name, one.place);
    text += fmt::format("{}{} = {}\n", margin, escaped(name), one.value);
  }
}

void Writer::type(std::string& text, const Container& in, TypeIndex index) {
  const Type& type = model_.at(index);
  const Declared& declared = *plan_.declared(index);
  text += "\n";
  const std::string full = full_name(type.scope, type.name);
  notes(text, type.notes, "    ", declared.renamed ? "name: " + type.name : "", full, type.place);
  if (type.kind != Kind::enumeration) {  // whose deployment has some
    lose_keys(type.notes, full, type.place);
  }
  lose_units_in(index, full, type.place);
  const std::string extends = type.base == no_type || plan_.is_left_out(type.base)
                                  ? ""
                                  : " extends " + plan_.reference(type.base, in);
  text += plan_.is_public(index) ? "    public " : "    ";
  switch (type.kind) {
    case Kind::array:
      text += fmt::format("array {} of {}\n", declared.name, plan_.reference(type.element.type, in));
      break;
    case Kind::structure:
    case Kind::choice:
      text += fmt::format("{} {}{}{} {{\n", type.kind == Kind::structure ? "struct" : "union", declared.name,
                          extends, type.polymorphic ? " polymorphic" : "");
      for (const Value& member : type.members) {
        value(text, in, member, plan_.member_name(index, member.name), "        ", full);
      }
      text += "    }\n";
      break;
    case Kind::enumeration:
      text += fmt::format("enumeration {}{} {{\n", declared.name, extends);
      enumerators(text, index, "        ", full);
      text += "    }\n";
      break;
    case Kind::map:
      text += fmt::format("map {} {{\n        {} to {}\n    }}\n", declared.name,
                          plan_.reference(type.key.type, in), plan_.reference(type.element.type, in));
      break;
    case Kind::alias:
      text += fmt::format("typedef {} is {}\n", declared.name, plan_.reference(type.element.type, in));
      break;
    case Kind::primitive:
    case Kind::string:
    case Kind::bytes:
      text += fmt::format("typedef {} is {}\n", declared.name, basic_name(type));
      break;
  }
}

void Writer::attribute(std::string& text, const Container& in, const Field& field) {
  const std::string element = full_name(in.service->scope, in.service->name) + "." + field.name;
  if (!plan_.is_written(field)) {
    lose(element, "an attribute without a value", field.place);
    return;
  }
  text += "\n";
  const Value& value = field.payload.values.front();
  Notes notes = field.notes;
  if (notes.unit.empty()) {
    notes.unit = value.notes.unit;
  }
  const std::string name = plan_.attribute_name(*in.service, field.name);
  this->notes(text, notes, "    ", told_name(field.name, name), element, field.place);
  lose_notes(value, element, field.place);
  text += fmt::format("    attribute {} {}{}{}", use(in, value.type), escaped(name),
                      field.has_setter ? "" : " readonly", field.has_notifier ? "" : " noSubscriptions");
  if (!field.has_getter) {
    if (field.has_setter || field.has_notifier) {
      text += " noRead";
    } else {
      lose(element, "an attribute that has neither getter nor setter nor notifier", field.place);
    }
  }
  text += "\n";
}

void Writer::method(std::string& text, const Container& in, const Method& method) {
  text += "\n";
  const std::string element =
      full_name(in.service->scope, in.service->name) + "." + member_key(method.name, method.selector);
  const std::string name = plan_.method_name(*in.service, method);
  notes(text, method.notes, "    ", told_name(method.name, name), element, method.place);
  text += fmt::format("    method {}{}{} {{\n", escaped(name), written_selector(method.selector),
                      method.fire_and_forget ? " fireAndForget" : "");
  const ArgumentNames names{method};
  arguments(text, in, "in", method.request.values, names.in, element, {});
  if (!method.fire_and_forget) {
    arguments(text, in, "out", method.response.values, names.out, element, method.inout);
    if (method.error != no_type && plan_.declared(method.error) != nullptr) {
      text += "        error " + plan_.reference(method.error, in) + "\n";
    } else if (method.error != no_type) {
      const Type& error = model_.at(method.error);
      text += "        error " +
              (error.base == no_type ? "" : "extends " + plan_.reference(error.base, in) + " ") + "{\n";
      enumerators(text, method.error, "            ", element);
      text += "        }\n";
    }
  }
  text += "    }\n";
}

void Writer::arguments(std::string& text, const Container& in, const char* word,
                       const std::vector<Value>& all, const std::vector<std::string>& names,
                       const std::string& owner, const std::vector<std::string>& inout) {
  if (all.empty()) {
    return;
  }
  text += fmt::format("        {} {{\n", word);
  for (std::size_t at = 0; at < all.size(); ++at) {
    const bool is_inout = std::ranges::find(inout, all[at].name) != inout.end();
    value(text, in, all[at], names[at], "            ", owner, is_inout);
  }
  text += "        }\n";
}

void Writer::event(std::string& text, const Container& in, const Event& event) {
  text += "\n";
  const std::string element =
      full_name(in.service->scope, in.service->name) + "." + member_key(event.name, event.selector);
  const std::string name = plan_.broadcast_name(*in.service, event);
  notes(text, event.notes, "    ", told_name(event.name, name), element, event.place);
  text += fmt::format("    broadcast {}{}{} {{\n", escaped(name), written_selector(event.selector),
                      event.selective ? " selective" : "");
  arguments(text, in, "out", event.payload.values, argument_names(event), element, {});
  text += "    }\n";
}

std::set<std::string> Writer::uses_of(const Container& container) {
  std::set<TypeIndex> types;
  add_types_of(container, types);
  std::set<std::size_t> collections;
  for (const TypeIndex type : types) {
    const Declared* const declared = plan_.declared(type);
    if (declared != nullptr && plan_.containers()[declared->container].service == nullptr) {
      collections.insert(declared->container);
    }
  }
  std::set<std::string> uses;
  for (const std::size_t index : collections) {
    const Container& other = plan_.containers()[index];
    const auto [has_any, is_new] = deployed_collections_.try_emplace(index, false);
    if (is_new) {
      std::vector<NotCarried> twice;  // what is said of it where it is written
      has_any->second = !Deployment{model_, plan_, twice}.collection(other).is_empty();
    }
    if (has_any->second) {
      uses.insert("use " + other.full());
    }
  }
  return uses;
}

void Writer::fdepl(const std::string& package) {
  Deployment deployment{model_, plan_, result_.not_carried};
  std::string text =
      "import "
      "\"platform:/plugin/org.genivi.commonapi.someip/deployment/"
      "CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\n";
  text += fmt::format("import \"{}.fidl\"\n", package);
  const std::set<std::string> others = imports(package);
  for (const std::string& other : others) {
    text += fmt::format("import \"{}.fdepl\"\n", other);
  }
  const std::vector<const Container*> containers = plan_.containers_of(package);
  for (const Container* const container : containers) {
    if (container->service == nullptr) {
      const Block block = deployment.collection(*container);
      text += block.is_empty() ? "" : "\n" + text_of(block);
    }
  }
  for (const Container* const container : containers) {
    if (container->service == nullptr) {
      continue;
    }
    Block block = deployment.interface(*container);
    const std::set<std::string> uses = uses_of(*container);
    block.settings.insert(block.settings.begin(), uses.begin(), uses.end());
    text += "\n" + text_of(block);
  }
  std::set<std::string, std::less<>> names;
  std::map<std::string, unsigned> name_uses;
  for (const Instance* const instance : providers_[package]) {
    const std::string service = plan_.service_name(instance->service);
    const std::string id = instance->id ? fmt::format("{}", static_cast<unsigned>(*instance->id)) : "x";
    const std::string name =
        free_name(usable(service.substr(service.rfind('.') + 1) + "_" + id, true), names, name_uses);
    text += "\n" + text_of(deployment.provider(*instance, name));
  }
  result_.files.push_back({package + ".fdepl", std::move(text)});
}

}  // namespace
}  // namespace fidl_writing

Written write_fidl(const Model& model) {
  std::vector<NotCarried> lost;
  const std::optional<Model> made = fidl_writing::with_enumerators(model, lost);
  const Model& whole = made ? *made : model;
  const std::optional<Model> distinct = fidl_writing::with_distinct_members(whole);
  Written written = fidl_writing::Writer{distinct ? *distinct : whole}.all();
  written.not_carried.insert(written.not_carried.begin(), lost.begin(), lost.end());
  return written;
}

}  // namespace trestle::describe
