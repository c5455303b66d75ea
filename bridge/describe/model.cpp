#include "bridge/describe/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <tuple>

namespace trestle::describe {

const char* to_string(Kind kind) noexcept {
  switch (kind) {
    case Kind::primitive:
      return "primitive";
    case Kind::string:
      return "string";
    case Kind::bytes:
      return "bytes";
    case Kind::array:
      return "array";
    case Kind::structure:
      return "structure";
    case Kind::choice:
      return "choice";
    case Kind::enumeration:
      return "enumeration";
    case Kind::map:
      return "map";
    case Kind::alias:
      return "alias";
  }
  return "";
}

Wire default_wire(Kind kind) noexcept {
  Wire wire;
  switch (kind) {
    case Kind::string:
    case Kind::bytes:
    case Kind::array:
    case Kind::choice:
    case Kind::map:
      wire.length = someip::FieldWidth::bits32;
      break;
    case Kind::primitive:
    case Kind::structure:
    case Kind::enumeration:
    case Kind::alias:
      break;
  }
  return wire;
}

const Protection& Protection::of(std::optional<someip::InstanceId> instance) const {
  const auto found = instance ? of_instances.find(*instance) : of_instances.end();
  return found == of_instances.end() ? *this : found->second;
}

void Protection::set(someip::InstanceId instance, const Protection& its) {
  if (std::tie(its.profile, its.numbers, its.words) == std::tie(profile, numbers, words)) {
    of_instances.erase(instance);
  } else {
    of_instances.insert_or_assign(instance, its);
  }
}

const Service* Model::service(std::string_view name) const {
  const auto found = std::ranges::find_if(
      services, [&](const Service& service) { return full_name(service.scope, service.name) == name; });
  return found == services.end() ? nullptr : &*found;
}

std::string full_name(std::string_view scope, std::string_view name) {
  std::string full{scope};
  if (!scope.empty()) {
    full += scope.front() == '/' ? '/' : '.';
  }
  return full += name;
}

bool has_made_name(const Service& service) {
  return service.scope.empty() && service.id &&
         service.name == fmt::format("service_{:04x}", someip::value(*service.id));
}

std::string label_of(const Instance& instance) {
  if (!instance.name.empty()) {
    return instance.name;
  }
  std::string label = !instance.service.empty() ? instance.service
                      : instance.service_id     ? fmt::format("0x{:04x}", someip::value(*instance.service_id))
                                                : std::string{"an unknown service"};
  return instance.id ? fmt::format("{} 0x{:04x}", label, someip::value(*instance.id)) : label;
}

std::map<TypeIndex, std::string> names_of_errors(const Model& model) {
  std::map<TypeIndex, std::string> names;
  for (const Service& service : model.services) {
    for (const Method& method : service.methods) {
      if (static_cast<std::size_t>(method.error) < model.types.size() &&
          model.at(method.error).name.empty()) {
        names.emplace(method.error,
                      fmt::format("{}.{}.error", full_name(service.scope, service.name), method.name));
      }
    }
  }
  return names;
}

bool is_of(const Instance& instance, const Service& service) {
  return instance.service.empty() ? instance.service_id && instance.service_id == service.id
                                  : instance.service == full_name(service.scope, service.name);
}

const Type& resolved(const Model& model, TypeIndex index) {
  static const Type nothing{.kind = Kind::alias};
  for (std::size_t steps = 0; static_cast<std::size_t>(index) < model.types.size(); ++steps) {
    const Type& type = model.at(index);
    if (type.kind != Kind::alias || steps == max_type_nesting) {
      return type;
    }
    index = type.element.type;
  }
  return nothing;
}

TypeIndex behind_aliases(const Model& model, TypeIndex index) {
  const Type& type = resolved(model, index);
  return type.kind == Kind::alias ? index : TypeIndex{static_cast<std::uint32_t>(&type - model.types.data())};
}

namespace {

/// The type and its bases, the outermost base first.
std::vector<const Type*> line_of(const Model& model, const Type& type) {
  std::vector<const Type*> line{&type};
  while (line.back()->base != no_type && line.size() <= max_type_nesting) {
    line.push_back(&resolved(model, line.back()->base));
  }
  std::ranges::reverse(line);
  return line;
}

}  // namespace

std::vector<Value> all_members(const Model& model, const Type& type) {
  std::vector<Value> all;
  for (const Type* part : line_of(model, type)) {
    all.insert(all.end(), part->members.begin(), part->members.end());
  }
  return all;
}

std::vector<Enumerator> all_enumerators(const Model& model, const Type& type) {
  std::vector<Enumerator> all;
  for (const Type* part : line_of(model, type)) {
    all.insert(all.end(), part->enumerators.begin(), part->enumerators.end());
  }
  return all;
}

namespace {

/// Shifts the indices of a model that becomes the end of another one.
struct Shift {
  std::uint32_t types;
  std::uint32_t files;

  void operator()(TypeIndex& type) const {
    if (type != no_type) {
      type = TypeIndex{static_cast<std::uint32_t>(type) + types};
    }
  }
  void operator()(Place& place) const { place.file += files; }
  void operator()(Value& value) const {
    (*this)(value.type);
    (*this)(value.place);
  }
  void operator()(Payload& payload) const { each(payload.values); }
  void operator()(Enumerator& enumerator) const { (*this)(enumerator.place); }
  void operator()(Constant& constant) const {
    (*this)(constant.type);
    (*this)(constant.place);
  }
  void operator()(Type& type) const {
    (*this)(type.variant_of);
    each(type.members);
    (*this)(type.base);
    each(type.enumerators);
    (*this)(type.element);
    (*this)(type.key);
    (*this)(type.place);
  }
  void operator()(std::optional<Place>& place) const {
    if (place) {
      (*this)(*place);
    }
  }
  void operator()(Transfer& transfer) const {
    (*this)(transfer.transport_at);
    (*this)(transfer.segment_bytes_at);
    (*this)(transfer.retention_at);
  }
  void operator()(Event& event) const {
    (*this)(event.payload);
    (*this)(event.transfer);
    (*this)(event.place);
    (*this)(event.id_place);
  }
  void operator()(Method& method) const {
    (*this)(method.request);
    (*this)(method.response);
    (*this)(method.request_transfer);
    (*this)(method.response_transfer);
    (*this)(method.error);
    (*this)(method.place);
    (*this)(method.id_place);
  }
  void operator()(Field& field) const {
    (*this)(field.payload);
    (*this)(field.getter_transfer);
    (*this)(field.setter_transfer);
    (*this)(field.notifier_transfer);
    (*this)(field.place);
    (*this)(field.getter_place);
    (*this)(field.setter_place);
    (*this)(field.notifier_place);
  }
  void operator()(Eventgroup& eventgroup) const { (*this)(eventgroup.place); }
  void operator()(Service& service) const {
    each(service.events);
    each(service.methods);
    each(service.fields);
    each(service.eventgroups);
    (*this)(service.place);
    (*this)(service.id_place);
  }
  void operator()(Multicast& multicast) const {
    (*this)(multicast.group_at);
    (*this)(multicast.threshold_at);
  }
  void operator()(Instance& instance) const {
    each(instance.multicast);
    (*this)(instance.place);
    for (auto& [setting, place] : instance.said_at) {
      (*this)(place);
    }
  }
  void operator()(Machine& machine) const { (*this)(machine.place); }
  void operator()(TypeCollection& collection) const { (*this)(collection.place); }
  template <typename Element>
  void each(std::vector<Element>& elements) const {
    for (Element& element : elements) {
      (*this)(element);
    }
  }
};

template <typename Element>
void move_to_end(std::vector<Element>& to, std::vector<Element>& from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

}  // namespace

void append(Model& to, Model from) {
  const Shift shift{static_cast<std::uint32_t>(to.types.size()), static_cast<std::uint32_t>(to.files.size())};
  shift.each(from.types);
  shift.each(from.services);
  shift.each(from.instances);
  shift.each(from.machines);
  shift.each(from.constants);
  shift.each(from.collections);
  for (const std::uint32_t file : from.configurations) {
    to.configurations.insert(file + static_cast<std::uint32_t>(to.files.size()));
  }
  move_to_end(to.files, from.files);
  move_to_end(to.types, from.types);
  move_to_end(to.services, from.services);
  move_to_end(to.instances, from.instances);
  move_to_end(to.machines, from.machines);
  move_to_end(to.observed_uses, from.observed_uses);
  move_to_end(to.constants, from.constants);
  move_to_end(to.collections, from.collections);
}

bool Reading::ok() const noexcept {
  return std::ranges::none_of(problems, [](const documents::Problem& problem) {
    return problem.severity == documents::Problem::Severity::error;
  });
}

}  // namespace trestle::describe
