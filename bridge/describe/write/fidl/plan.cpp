#include "bridge/describe/write/fidl/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "bridge/describe/fidl_words.hpp"

namespace trestle::describe::fidl_writing {
namespace {

const std::vector<std::string>& cpp_keywords() {
  static const std::vector<std::string> words = [] {
    std::vector<std::string> all{
        "alignas",   "alignof",  "and",      "and_eq",    "asm",          "auto",          "bitand",
        "bitor",     "bool",     "break",    "case",      "catch",        "char",          "char16_t",
        "char32_t",  "class",    "compl",    "const",     "constexpr",    "const_cast",    "continue",
        "decltype",  "default",  "delete",   "do",        "double",       "dynamic_cast",  "else",
        "enum",      "explicit", "export",   "extern",    "false",        "float",         "for",
        "friend",    "goto",     "if",       "inline",    "int",          "long",          "mutable",
        "namespace", "new",      "noexcept", "not",       "not_eq",       "nullptr",       "operator",
        "or",        "or_eq",    "private",  "protected", "public",       "register",      "reinterpret_cast",
        "return",    "short",    "signed",   "sizeof",    "static",       "static_assert", "static_cast",
        "struct",    "switch",   "template", "this",      "thread_local", "throw",         "true",
        "try",       "typedef",  "typeid",   "typename",  "union",        "unsigned",      "using",
        "virtual",   "void",     "volatile", "wchar_t",   "while",        "xor",           "xor_eq"};
    std::ranges::sort(all);
    return all;
  }();
  return words;
}

bool is_word(const std::vector<std::string>& words, const std::string& name) {
  return std::ranges::binary_search(words, name);
}

/// "a.b" of "/a/b", usable as a package.
std::string package_of(std::string_view scope) {
  std::string package;
  std::string part;
  const auto finish = [&] {
    if (!part.empty()) {
      std::string name = usable(part, true);
      package += (package.empty() ? "" : ".") + (is_word(fdepl_keywords(), name) ? name + "_" : name);
      part.clear();
    }
  };
  for (const char c : scope) {
    if (c == '/' || c == '.') {
      finish();
    } else {
      part += c;
    }
  }
  finish();
  return package.empty() ? "unnamed" : package;
}

/// The same where it can be the name of a file, else its beginning and a checksum of it.
std::string fitting(const std::string& package) {
  constexpr std::size_t most = 200;
  if (package.size() <= most) {
    return package;
  }
  std::uint32_t sum = 2166136261U;  // FNV-1a
  for (const char character : package) {
    sum = (sum ^ static_cast<unsigned char>(character)) * 16777619U;
  }
  return fmt::format("{}_{:08x}", std::string_view{package}.substr(0, most - 9), sum);
}

/// FDEPL says nothing of an error that a method declares in place: it is as wide as its base, or has one
/// byte.
bool can_stand_in_method(const Model& model, const Type& error) {
  if (error.backing || error.invalid_value || error.wire.bits != 0) {
    return false;
  }
  const bool has_sign =
      std::ranges::any_of(error.enumerators, [](const Enumerator& one) { return one.value < 0; });
  const messages::Primitive plain = error.base != no_type ? resolved(model, error.base).primitive
                                    : has_sign            ? messages::Primitive::int8
                                                          : messages::Primitive::uint8;
  return error.primitive == plain;
}

}  // namespace

std::string usable(std::string_view name, bool is_type) {
  std::string result;
  for (const char c : name) {
    const bool fits = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || (c >= '0' && c <= '9');
    result += fits ? c : '_';
  }
  if (result.empty() || (result.front() >= '0' && result.front() <= '9')) {
    result.insert(0, "_");
  }
  if (is_word(cpp_keywords(), result) || (is_type && is_word(fidl_keywords(), result))) {
    result += '_';
  }
  return result;
}

std::string escaped(std::string_view name) {
  const std::string text{name};
  return is_word(fidl_keywords(), text) ? "^" + text : text;
}

std::string escaped_fdepl(std::string_view name) {
  const std::string text{name};
  return is_word(fdepl_keywords(), text) ? "^" + text : text;
}

bool is_undefined(const Type& type) {
  return type.polymorphic && type.scope.empty() && type.name == "undefined" && type.members.empty();
}

std::string basic_name(const Type& type) {
  if (is_undefined(type)) {
    return "undefined";
  }
  if (type.kind == Kind::string) {
    return "String";
  }
  if (type.kind == Kind::bytes) {
    return "ByteBuffer";
  }
  if (type.kind == Kind::primitive && type.primitive == messages::Primitive::int32 &&
      (type.minimum || type.maximum)) {
    return fmt::format("Integer({}, {})", type.minimum ? fmt::format("{}", *type.minimum) : "minInt",
                       type.maximum ? fmt::format("{}", *type.maximum) : "maxInt");
  }
  switch (type.primitive) {
    case messages::Primitive::boolean:
      return "Boolean";
    case messages::Primitive::int8:
      return "Int8";
    case messages::Primitive::int16:
      return "Int16";
    case messages::Primitive::uint16:
      return "UInt16";
    case messages::Primitive::int32:
      return "Int32";
    case messages::Primitive::uint32:
      return "UInt32";
    case messages::Primitive::int64:
      return "Int64";
    case messages::Primitive::uint64:
      return "UInt64";
    case messages::Primitive::float32:
      return "Float";
    case messages::Primitive::float64:
      return "Double";
    case messages::Primitive::byte:
    case messages::Primitive::character:
    case messages::Primitive::uint8:
    case messages::Primitive::string:
    case messages::Primitive::wstring:
      break;
  }
  return "UInt8";
}

Plan::Plan(const Model& model, std::vector<NotCarried>& lost) : model_{model}, lost_{lost} {
  for (const Service& service : model.services) {
    for (const Method& method : service.methods) {
      if (method.error != no_type && model.at(method.error).name.empty() &&
          can_stand_in_method(model, model.at(method.error))) {
        own_errors_.insert(method.error);
      }
    }
  }
  place_services();
  leave_out_empty_types();
  place_types();
  place_collections();
  find_public_types();
  name_members();
}

std::vector<std::string> Plan::packages() const {
  return {packages_.begin(), packages_.end()};
}

TypeIndex Plan::root(TypeIndex type) const {
  for (std::size_t steps = 0; steps < model_.types.size() && model_.at(type).variant_of != no_type; ++steps) {
    type = model_.at(type).variant_of;
  }
  return type;
}

const Declared* Plan::declared(TypeIndex type) const {
  const auto found = declared_.find(root(type));
  return found == declared_.end() ? nullptr : &found->second;
}

bool Plan::is_inline(TypeIndex type) const {
  return model_.at(type).kind == Kind::array && declared(type) == nullptr;
}

bool Plan::needs_declaration(TypeIndex index) const {
  const Type& type = model_.at(index);
  switch (type.kind) {
    case Kind::primitive:
    case Kind::string:
    case Kind::bytes:
      return !type.name.empty();  // a typedef
    case Kind::array: {
      const Type& element = model_.at(type.element.type);
      const bool has_own_rules =
          element.name.empty() &&
          (element.kind == Kind::primitive || element.kind == Kind::string || element.kind == Kind::bytes) &&
          (type.element.wire != default_wire(element.kind) || element.invalid_value || element.max_size > 0);
      // FDEPL has no place for the rules of a basic element in a declared array.
      return has_own_rules ? false : !type.name.empty();
    }
    case Kind::structure:
      return !is_undefined(type) && !own_errors_.contains(index);
    case Kind::choice:
    case Kind::enumeration:
    case Kind::map:
    case Kind::alias:
      break;
  }
  return !own_errors_.contains(index);
}

std::string free_name(const std::string& wanted, std::set<std::string, std::less<>>& names,
                      std::map<std::string, unsigned>& uses) {
  unsigned& number = uses[wanted];
  std::string name = wanted;
  while (!names.insert(name).second) {
    ++number;
    name = wanted + "_" + (number == 1 ? std::string{} : std::to_string(number));
  }
  return name;
}

std::string Plan::free_name(Container& container, const std::string& wanted) {
  const auto is_inherited = [&](const std::string& name) {
    std::optional<std::size_t> base = container.base;
    for (std::size_t steps = 0; base && &containers_[*base] != &container && steps < max_type_nesting;
         ++steps) {
      if (containers_[*base].names.contains(name)) {
        return true;
      }
      base = containers_[*base].base;
    }
    return false;
  };
  std::string name;
  do {
    name = fidl_writing::free_name(wanted, container.names, container.name_uses);
  } while (is_inherited(name));
  return name;
}

std::size_t Plan::depth(std::size_t container) const {
  std::size_t steps = 0;
  for (std::optional<std::size_t> base = containers_[container].base; base && steps < max_type_nesting;
       base = containers_[*base].base) {
    ++steps;
  }
  return steps;
}

void Plan::place_services() {
  std::map<std::string, Container> packages;  // for their names
  for (const Service& service : model_.services) {
    Container container;
    container.package = fitting(package_of(service.scope));
    if (container.package != service.scope) {
      lost_.push_back({full_name(service.scope, service.name),
                       fmt::format("the package '{}' is written as {}", service.scope, container.package),
                       service.place});
    }
    container.service = &service;
    std::string name = usable(service.name, true);
    if (is_word(fdepl_keywords(), name)) {
      name += '_';  // "a.Interface" has no place for ^
    }
    container.name = free_name(packages[container.package], name);
    interfaces_.insert(container.full());
    services_.emplace(full_name(service.scope, service.name), containers_.size());
    by_package_[container.package].push_back(containers_.size());
    packages_.insert(container.package);
    by_scope_.emplace(full_name(service.scope, service.name), containers_.size());
    containers_.push_back(std::move(container));
  }
  for (Container& container : containers_) {
    if (const auto base = services_.find(container.service->base); base != services_.end()) {
      container.base = base->second;
    }
  }
}

std::size_t Plan::container_for(const std::string& scope) {
  const auto found = by_scope_.find(scope);
  if (found != by_scope_.end()) {
    return found->second;
  }
  Container container;
  const std::string path = package_of(scope);
  const std::size_t dot = path.rfind('.');
  if (packages_.contains(fitting(path)) || dot == std::string::npos) {
    container.package = fitting(path);
  } else {
    container.package = fitting(path.substr(0, dot));
    container.name = path.substr(dot + 1);
  }
  while (interfaces_.contains(container.full())) {
    container.name += '_';
  }
  if (!path.starts_with(container.package)) {
    lost_.push_back({scope, fmt::format("its package, which is too long for a file, is written as {}",
                                        container.package)});
  }
  const auto [same, is_new] = collections_.try_emplace(container.full(), containers_.size());
  if (!is_new) {
    by_scope_.emplace(scope, same->second);
    return same->second;
  }
  packages_.insert(container.package);
  by_package_[container.package].push_back(containers_.size());
  by_scope_.emplace(scope, containers_.size());
  containers_.push_back(std::move(container));
  return containers_.size() - 1;
}

void Plan::leave_out_empty_types() {
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < model_.types.size(); ++i) {
      const TypeIndex index{static_cast<std::uint32_t>(i)};
      const Type& type = model_.types[i];
      if (type.variant_of != no_type || left_out_.contains(index)) {
        continue;
      }
      bool is_empty = false;
      if (type.kind == Kind::structure || type.kind == Kind::choice) {
        is_empty =
            !type.polymorphic && (type.base == no_type || is_left_out(type.base)) &&
            std::ranges::all_of(type.members, [&](const Value& member) { return is_left_out(member.type); });
      } else if (type.kind == Kind::enumeration) {
        is_empty = type.enumerators.empty();
      } else if (type.kind == Kind::array || type.kind == Kind::alias || type.kind == Kind::map) {
        is_empty = is_left_out(type.element.type) || (type.kind == Kind::map && is_left_out(type.key.type));
      }
      if (is_empty) {
        left_out_.insert(index);
        if (!type.name.empty()) {  // else its uses tell
          lost_.push_back(
              {full_name(type.scope, type.name), "a type without content, and what is of it", type.place});
        }
        changed = true;
      }
    }
  }
}

void Plan::find_public_types() {
  const auto inherits = [&](std::size_t heir, const Container& base) {
    const Container* at = &containers_[heir];
    for (std::size_t steps = 0; at != nullptr && at->service != nullptr && steps < max_type_nesting;
         ++steps) {
      if (at == &base) {
        return true;
      }
      at = service(at->service->base);
    }
    return false;
  };
  const auto use = [&](std::size_t from, TypeIndex type) {
    for (std::size_t steps = 0; type != no_type && steps < max_type_nesting; ++steps) {
      if (const Declared* const found = declared(type)) {
        const Container& there = containers_[found->container];
        if (there.service != nullptr && !inherits(from, there)) {
          public_.insert(root(type));
        }
        return;
      }
      const Type& it = model_.at(root(type));
      type = it.kind == Kind::array ? it.element.type : no_type;
    }
  };
  for (const auto& [index, where] : declared_) {
    const Type& type = model_.at(index);
    for (const TypeIndex other : {type.base, type.element.type, type.key.type}) {
      use(where.container, other);
    }
    for (const Value& member : type.members) {
      use(where.container, member.type);
    }
  }
  for (std::size_t i = 0; i < containers_.size(); ++i) {
    if (containers_[i].service == nullptr) {
      continue;
    }
    const auto payload = [&](const Payload& one) {
      std::ranges::for_each(one.values, [&](const Value& value) { use(i, value.type); });
    };
    for (const Field& field : containers_[i].service->fields) {
      payload(field.payload);
    }
    for (const Event& event : containers_[i].service->events) {
      payload(event.payload);
    }
    for (const Method& method : containers_[i].service->methods) {
      payload(method.request);
      payload(method.response);
      use(i, method.error);
      if (method.error != no_type) {
        use(i, model_.at(method.error).base);
      }
    }
  }
}

std::set<TypeIndex> Plan::arrays_in_types() const {
  std::set<TypeIndex> arrays;
  const auto look_at = [&](const Value& value) {
    if (value.type != no_type && model_.at(root(value.type)).kind == Kind::array) {
      arrays.insert(root(value.type));
    }
  };
  for (const Type& type : model_.types) {
    if (type.kind == Kind::array || type.kind == Kind::alias || type.kind == Kind::map) {
      look_at(type.element);
      look_at(type.key);
    }
  }
  return arrays;
}

void Plan::place_types() {
  // T[] stands only where a member, argument or attribute is: an array of one needs a name.
  const std::set<TypeIndex> inner = arrays_in_types();
  std::vector<TypeIndex> order;
  for (std::size_t i = 0; i < model_.types.size(); ++i) {
    const TypeIndex index{static_cast<std::uint32_t>(i)};
    if (model_.types[i].variant_of == no_type && !left_out_.contains(index) &&
        (needs_declaration(index) || inner.contains(index))) {
      order.push_back(index);
    }
  }
  // Those of an interface before those of its heirs, which must not have their names.
  std::map<TypeIndex, std::size_t> depths;
  for (const TypeIndex index : order) {
    const auto service = by_scope_.find(model_.at(index).scope);
    depths[index] = service == by_scope_.end() ? 0 : depth(service->second);
  }
  std::ranges::stable_sort(order, {}, [&](TypeIndex index) { return depths.at(index); });
  std::map<std::size_t, int> unnamed;
  for (const TypeIndex index : order) {
    const Type& type = model_.at(index);
    const bool has_own_name = needs_declaration(index);
    Declared declared;
    declared.container = container_for(!type.scope.empty()                   ? type.scope
                                       : has_own_name || containers_.empty() ? "unnamed"
                                                                             : containers_.front().full());
    Container& container = containers_[declared.container];
    declared.name =
        free_name(container, type.name.empty() ? fmt::format("Unnamed{}", ++unnamed[declared.container])
                                               : usable(type.name, true));
    declared.renamed = !has_own_name || declared.name != type.name;
    container.types.push_back(index);
    declared_.emplace(index, std::move(declared));
  }
  for (const Constant& constant : model_.constants) {
    containers_[container_for(constant.scope.empty() ? "unnamed" : constant.scope)].constants.push_back(
        &constant);
  }
}

void Plan::place_collections() {
  for (const TypeCollection& collection : model_.collections) {
    Container& container =
        containers_[container_for(collection.scope.empty() ? "unnamed" : collection.scope)];
    if (container.service == nullptr && container.collection == nullptr) {
      container.collection = &collection;
    } else {
      lost_.push_back(
          {collection.scope, "the version and the description of its type collection", collection.place});
    }
  }
}

namespace {

/// Gives names to siblings, each once.
class Siblings {
 public:
  /// Of one that is asked for again, as overloaded methods are, the same.
  std::string name(const std::string& name) {
    const auto [given, is_new] = given_.try_emplace(name);
    if (is_new) {
      given->second = free_name(usable(name, false), names_, uses_);
    }
    return given->second;
  }
  /// One more of a name that was given.
  std::string another(const std::string& given) { return free_name(given, names_, uses_); }

 private:
  std::map<std::string, std::string> given_;
  std::set<std::string, std::less<>> names_;
  std::map<std::string, unsigned> uses_;
};

}  // namespace

/// Inherited ones come first, so that they have the names that they have where they are declared.
void Plan::name_members() {
  const auto name_all = [&](const void* owner, const char* kind, const auto& all) {
    if (std::ranges::all_of(all, [](const auto& one) { return usable(one.name, false) == one.name; })) {
      return;  // as nearly always
    }
    Siblings siblings;
    for (const auto& one : all) {
      std::string name = siblings.name(one.name);
      if (name != usable(one.name, false)) {
        other_names_.emplace(std::pair{owner, kind + one.name}, std::move(name));
      }
    }
  };
  for (const Type& type : model_.types) {
    if (type.base == no_type) {
      name_all(&type, "", type.members);
      name_all(&type, "", type.enumerators);
    } else {
      name_all(&type, "", all_members(model_, type));
      name_all(&type, "", all_enumerators(model_, type));
    }
  }
  const auto name_overloads = [&](const Service& service, const std::string& kind, const auto& all,
                                  const auto& signature_of) {
    Siblings siblings;
    std::set<std::string> taken;
    for (const auto& one : all) {
      const std::string wanted = siblings.name(one.name);
      std::string name = wanted;
      while (!taken.insert(name + signature_of(one)).second) {
        name = siblings.another(wanted);
      }
      if (name != usable(one.name, false)) {
        other_names_.emplace(std::pair{&service, kind + member_key(one.name, one.selector)}, std::move(name));
      }
    }
  };
  for (const Service& service : model_.services) {
    name_all(&service, "attribute ", service.fields);
    name_overloads(service, "method ", service.methods, [&](const Method& method) {
      const bool answers = !method.fire_and_forget && !method.response.values.empty();
      return signature(method.request.values) + (answers ? "_" + signature(method.response.values) : "");
    });
    name_overloads(service, "broadcast ", service.events,
                   [&](const Event& event) { return signature(event.payload.values); });
  }
  std::vector<std::size_t> order(containers_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t container) { return depth(container); });
  for (const std::size_t container : order) {
    for (const Constant* const one : containers_[container].constants) {
      std::string name = free_name(containers_[container], usable(one->name, false));  // none of a type
      if (name != usable(one->name, false)) {
        other_names_.emplace(std::pair{one, ""}, std::move(name));
      }
    }
  }
}

std::string Plan::signature(const std::vector<Value>& values) const {
  std::string all;
  for (const Value& value : values) {
    if (is_left_out(value.type)) {
      continue;
    }
    const TypeIndex outer = root(value.type);
    const bool is_array = is_inline(outer);
    const TypeIndex index = is_array ? root(model_.at(outer).element.type) : outer;
    const Declared* const found = declared(index);
    std::string name = found != nullptr ? found->name : basic_name(model_.at(index));
    if (found == nullptr && (name.starts_with("Int") || name.starts_with("UInt"))) {
      name = "Integer";
    }
    all += "_" + name + (is_array ? "[]" : "");
  }
  return all;
}

std::string Plan::name_of(const void* owner, const std::string& key, const std::string& name) const {
  const auto other = other_names_.empty() ? other_names_.end() : other_names_.find(std::pair{owner, key});
  return other == other_names_.end() ? usable(name, false) : other->second;
}

std::string Plan::member_name(TypeIndex type, const std::string& name) const {
  return name_of(&model_.at(type), name, name);
}

std::string Plan::attribute_name(const Service& service, const std::string& name) const {
  return name_of(&service, "attribute " + name, name);
}

std::string Plan::method_name(const Service& service, const Method& method) const {
  return name_of(&service, "method " + member_key(method.name, method.selector), method.name);
}

std::string Plan::broadcast_name(const Service& service, const Event& event) const {
  return name_of(&service, "broadcast " + member_key(event.name, event.selector), event.name);
}

std::string Plan::constant_name(const Constant& constant) const {
  return name_of(&constant, "", constant.name);
}

std::vector<std::string> argument_names(const Event& event) {
  Siblings siblings;
  std::vector<std::string> names;
  for (const Value& value : event.payload.values) {
    names.push_back(siblings.name(value.name));
  }
  return names;
}

ArgumentNames::ArgumentNames(const Method& method) {
  std::set<std::string, std::less<>> names;
  std::map<std::string, unsigned> uses;
  for (const Value& value : method.request.values) {
    in.push_back(free_name(usable(value.name, false), names, uses));
  }
  for (const Value& value : method.response.values) {
    const std::string wanted = usable(value.name, false);
    out.push_back(free_name(wanted + (names.contains(wanted) ? "_out" : ""), names, uses));
  }
}

std::string Plan::reference(TypeIndex type, const Container& from) const {
  const Declared* found = declared(type);
  if (found == nullptr) {
    const Type& it = model_.at(root(type));
    return it.kind == Kind::array ? reference(it.element.type, from) : basic_name(it);
  }
  const Container& container = containers_[found->container];
  return &container == &from ? found->name : container.full() + "." + found->name;
}

std::vector<const Container*> Plan::containers_of(const std::string& package) const {
  std::vector<const Container*> all;
  if (const auto found = by_package_.find(package); found != by_package_.end()) {
    for (const std::size_t index : found->second) {
      all.push_back(&containers_[index]);
    }
  }
  return all;
}

const Container* Plan::service(std::string_view full) const {
  const auto found = services_.find(full);
  return found == services_.end() ? nullptr : &containers_[found->second];
}

std::string Plan::service_name(std::string_view full) const {
  const Container* const container = service(full);
  return container == nullptr ? std::string{} : container->full();
}

}  // namespace trestle::describe::fidl_writing
