#include <algorithm>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/write/arxml/writer.hpp"

namespace trestle::describe::arxml_writer {

using messages::Primitive;

namespace {

struct BaseType {
  const char* name;
  const char* bits;
  const char* encoding;
};

[[nodiscard]] BaseType facts(Primitive primitive) noexcept {
  switch (primitive) {
    case Primitive::boolean:
      return {"boolean", "8", "BOOLEAN"};
    case Primitive::int8:
      return {"int8", "8", "2C"};
    case Primitive::int16:
      return {"int16", "16", "2C"};
    case Primitive::uint16:
      return {"uint16", "16", "NONE"};
    case Primitive::int32:
      return {"int32", "32", "2C"};
    case Primitive::uint32:
      return {"uint32", "32", "NONE"};
    case Primitive::int64:
      return {"int64", "64", "2C"};
    case Primitive::uint64:
      return {"uint64", "64", "NONE"};
    case Primitive::float32:
      return {"float32", "32", "IEEE754"};
    case Primitive::float64:
      return {"float64", "64", "IEEE754"};
    default:
      return {"uint8", "8", "NONE"};
  }
}

}  // namespace

std::string Writer::package_of(std::string_view scope) const {
  std::string path;
  std::string part;
  const auto flush = [&] {
    if (!part.empty()) {
      path += "/" + short_name(part);
      // Franca's tools put the types of an interface into a package of its name; here, names are unique.
      if (service_paths_.contains(path)) {
        path += "_Types";
      }
      part.clear();
    }
  };
  for (const char letter : scope) {
    if (letter == '.' || letter == '/') {
      flush();
    } else {
      part += letter;
    }
  }
  flush();
  return path.empty() ? "/Model" : path;
}

namespace {

/// The one that all others are variants of.
[[nodiscard]] TypeIndex first_of(const Model& model, TypeIndex index) {
  TypeIndex first = index;
  for (std::size_t steps = 0; model.at(first).variant_of != no_type; ++steps) {
    if (steps == model.types.size()) {
      return index;  // variants that go round
    }
    first = model.at(first).variant_of;
  }
  return first;
}

/// A use of a type that says no more than the type itself.
[[nodiscard]] Value plain_use(const Model& model, TypeIndex index) {
  const Type& type = model.at(index);
  return {.type = index, .wire = type.kind == Kind::alias ? type.element.wire : type.wire};
}

/// What AUTOSAR's type says of one, without the types in it. Rules of the wire have a place of their own.
[[nodiscard]] std::string own_facts(const Model& model, const Type& type) {
  std::string facts;
  const auto add = [&](const auto& number) { facts += std::to_string(number) + ' '; };
  const auto add_optional = [&](const auto& number) {
    facts += number ? std::to_string(*number) + ' ' : "- ";
  };
  add(static_cast<int>(type.kind));
  if (type.kind == Kind::primitive || type.kind == Kind::enumeration) {
    add(static_cast<int>(type.primitive));
    add_optional(type.minimum);
    add_optional(type.maximum);
    add_optional(type.invalid_value);
  }
  if (type.kind != Kind::string) {  // text_size()
    add(type.min_size);
    add(type.max_size);
    add(static_cast<int>(type.fixed_size));
  }
  for (const Enumerator& enumerator : all_enumerators(model, type)) {
    facts += enumerator.name + ' ';
    add(enumerator.value);
  }
  for (const std::uint32_t selector : type.selectors) {
    add(selector);
  }
  return facts;
}

}  // namespace

void Writer::group_variants() {
  representatives_.clear();
  std::map<TypeIndex, std::vector<TypeIndex>> families;  // the one that all are variants of, first
  for (std::size_t i = 0; i < model_.types.size(); ++i) {
    const TypeIndex own_index{static_cast<std::uint32_t>(i)};
    const TypeIndex root = first_of(model_, own_index);
    representatives_.push_back(root);
    std::vector<TypeIndex>& family = families.try_emplace(root, std::vector{root}).first->second;
    if (root != own_index) {
      family.push_back(own_index);
    }
  }
  std::erase_if(families, [](const auto& family) { return family.second.size() == 1; });
  std::map<TypeIndex, std::string> facts;
  std::map<TypeIndex, std::vector<Value>> members;
  for (const auto& [root, family] : families) {
    for (const TypeIndex index : family) {
      facts[index] = own_facts(model_, model_.at(index));
      members[index] = all_members(model_, model_.at(index));
    }
  }
  // At first all of a family are one. Those that differ go apart, and then those that they are in.
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [root, family] : families) {
      std::map<std::string, TypeIndex> firsts;
      std::vector<TypeIndex> found;
      for (const TypeIndex index : family) {
        std::string key = facts[index];
        const auto add = [&](const Value& value) {
          key += '\n' + value.name + ' ' +
                 (value.tag ? std::to_string(static_cast<unsigned>(*value.tag)) : "-") +
                 (value.optional ? " ?" : " ");
          if (value.type != no_type) {
            key += std::to_string(static_cast<std::uint32_t>(representative(value.type))) + ' ' +
                   std::to_string(text_size(value));
          }
        };
        for (const Value& member : members[index]) {
          add(member);
        }
        add(model_.at(index).element);
        add(model_.at(index).key);
        found.push_back(firsts.try_emplace(std::move(key), index).first->second);
      }
      for (std::size_t i = 0; i < family.size(); ++i) {  // only now: a type may contain itself
        TypeIndex& known = representatives_[static_cast<std::size_t>(family[i])];
        changed = changed || known != found[i];
        known = found[i];
      }
    }
  }
}

/// Of a string in a payload: the size that its type has, in bytes if it has no length field.
std::uint32_t Writer::text_size(const Value& use) const {
  const Type& type = resolved(model_, use.type);
  if (type.kind != Kind::string) {
    return 0;
  }
  const bool fixed = use.wire.length == someip::FieldWidth::none && use.wire.fixed_bytes > 0;
  return fixed ? use.wire.fixed_bytes : type.max_size;
}

std::string Writer::base_type(Primitive primitive) {
  const BaseType base = facts(primitive);
  const std::string package = std::string{own} + "/BaseTypes";
  if (!packages_.has(package, base.name)) {
    Xml xml;
    xml.open("SW-BASE-TYPE");
    xml.leaf("SHORT-NAME", base.name);
    xml.leaf("CATEGORY", "FIXED_LENGTH");
    xml.leaf("BASE-TYPE-SIZE", base.bits);
    xml.leaf("BASE-TYPE-ENCODING", base.encoding);
    xml.close();
    packages_.add(package, base.name, xml.text());
  }
  return package + "/" + base.name;
}

std::string Writer::primitive_path(Primitive primitive) {
  const BaseType base = facts(primitive);
  const std::string package = std::string{own} + "/Primitives";
  if (!packages_.has(package, base.name)) {
    Xml xml;
    xml.open("STD-CPP-IMPLEMENTATION-DATA-TYPE");
    xml.leaf("SHORT-NAME", base.name);
    xml.leaf("CATEGORY", "VALUE");
    Type number{.kind = Kind::primitive, .primitive = primitive};
    number_properties(xml, number, base.name, {});
    xml.close();
    packages_.add(package, base.name, xml.text());
  }
  return package + "/" + base.name;
}

void Writer::number_properties(Xml& xml, const Type& number, const std::string& name,
                               const std::string& compu) {
  const std::string base = base_type(number.primitive);
  std::string constraint;
  if (number.minimum || number.maximum) {
    const std::string package = std::string{own} + "/Constraints";
    const std::string unique = packages_.unique(package, name);
    Xml rule;
    rule.open("DATA-CONSTR");
    rule.leaf("SHORT-NAME", unique);
    rule.open("DATA-CONSTR-RULES");
    rule.open("DATA-CONSTR-RULE");
    rule.open("INTERNAL-CONSTRS");
    if (number.minimum) {
      rule.leaf("LOWER-LIMIT INTERVAL-TYPE=\"CLOSED\"", std::to_string(*number.minimum));
    }
    if (number.maximum) {
      rule.leaf("UPPER-LIMIT INTERVAL-TYPE=\"CLOSED\"", std::to_string(*number.maximum));
    }
    rule.close();
    rule.close();
    rule.close();
    rule.close();
    packages_.add(package, unique, rule.text());
    constraint = package + "/" + unique;
  }
  xml.open("SW-DATA-DEF-PROPS");
  xml.open("SW-DATA-DEF-PROPS-VARIANTS");
  xml.open("SW-DATA-DEF-PROPS-CONDITIONAL");
  xml.reference("BASE-TYPE-REF", "SW-BASE-TYPE", base);
  if (!compu.empty()) {
    xml.reference("COMPU-METHOD-REF", "COMPU-METHOD", compu);
  }
  if (!constraint.empty()) {
    xml.reference("DATA-CONSTR-REF", "DATA-CONSTR", constraint);
  }
  if (number.invalid_value) {
    xml.open("INVALID-VALUE");
    xml.open("NUMERICAL-VALUE-SPECIFICATION");
    xml.leaf("VALUE", std::to_string(*number.invalid_value));
    xml.close();
    xml.close();
  }
  xml.close();
  xml.close();
  xml.close();
}

void Writer::write_types() {
  for (std::size_t i = 0; i < model_.types.size(); ++i) {
    const TypeIndex index{static_cast<std::uint32_t>(i)};
    const Type& type = model_.types[i];
    if (representative(index) == index && !type.name.empty()) {
      (void)path_of(plain_use(model_, index));
    }
  }
}

const std::string& Writer::path_of(const Value& use) {
  return path_of(use.type, text_size(use));
}

const std::string& Writer::path_of(TypeIndex wanted, std::uint32_t size) {
  const TypeIndex index = representative(wanted);
  const std::pair key{index, size};
  const auto known = type_paths_.find(key);
  if (known != type_paths_.end()) {
    return known->second;
  }
  const Type& type = model_.at(index);
  if (type.name.empty() && type.kind == Kind::primitive && !type.minimum && !type.maximum &&
      !type.invalid_value) {
    return type_paths_[key] = primitive_path(type.primitive);
  }
  if (const TypeIndex first = first_of(model_, index); first != index && !type.name.empty()) {
    (void)path_of(plain_use(model_, first));  // it has the name, others have a number behind it
  }
  std::string package = type.name.empty() ? std::string{own} + "/Unnamed" : package_of(type.scope);
  std::string name = type.name;
  if (name.empty()) {
    name = to_string(type.kind);
  }
  const std::string unique = packages_.unique(package, name);
  if (!type.name.empty() && package.find("_Types") != std::string::npos &&
      type.scope.find("_Types") == std::string::npos) {
    lost(full_name(type.scope, type.name), "its package: it is " + package, type.place);
  }
  if (!type.name.empty() && unique != type.name) {
    lost(full_name(type.scope, type.name), "its name: it is " + unique, type.place);
  }
  // Before what is in it: types that go round end here.
  const std::string& path = type_paths_[key] = package + "/" + unique;
  write_type(index, size, path);
  return path;
}

void Writer::write_members(Xml& xml, const std::vector<Value>& members, const std::string& type_path) {
  if (members.empty()) {
    return;
  }
  xml.open("SUB-ELEMENTS");
  Names names;
  for (const Value& member : members) {
    const auto [known, is_new] = members_.try_emplace({type_path, member.name});
    if (is_new) {
      known->second = names.take(short_name(member.name));
    }
    const std::string& name = known->second;
    if (name != member.name) {
      lost(type_path + "." + member.name, "its name: it is " + name, member.place);
    }
    xml.open("CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT");
    xml.leaf("SHORT-NAME", name);
    notes(xml, member.notes);
    if (member.optional) {
      xml.leaf("IS-OPTIONAL", "true");
    }
    xml.open("TYPE-REFERENCE");
    xml.reference("TYPE-REFERENCE-REF", "STD-CPP-IMPLEMENTATION-DATA-TYPE", path_of(member));
    xml.close();
    xml.close();
    write_tag(member.tag, "TLV-IMPLEMENTATION-DATA-TYPE-ELEMENT-REF", "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT",
              type_path + "/" + name);
    if (!member.default_value.empty()) {
      lost(type_path + "." + member.name, "its default value", member.place);
    }
  }
  xml.close();
}

std::string Writer::label(const Type& type) const {
  if (!type.name.empty()) {
    return full_name(type.scope, type.name);
  }
  const auto error = error_names_.find(TypeIndex{static_cast<std::uint32_t>(&type - model_.types.data())});
  return error == error_names_.end() ? std::string{to_string(type.kind)} : error->second;
}

void Writer::lose_units_in(const Type& type, const std::string& called) {
  for (const Value* const part : {&type.key, &type.element}) {
    if (!part->notes.unit.empty()) {
      lost(called, "the unit of its elements: " + part->notes.unit, type.place);
    }
  }
}

void Writer::write_enumeration(const Type& type, const std::string& package, const std::string& name) {
  const std::string methods = std::string{own} + "/CompuMethods";
  const std::string method = packages_.unique(methods, name);
  Xml compu;
  compu.open("COMPU-METHOD");
  compu.leaf("SHORT-NAME", method);
  compu.leaf("CATEGORY", "TEXTTABLE");
  compu.open("COMPU-INTERNAL-TO-PHYS");
  compu.open("COMPU-SCALES");
  for (const Enumerator& enumerator : all_enumerators(model_, type)) {
    compu.open("COMPU-SCALE");
    compu.leaf("SYMBOL", enumerator.name);
    if (!enumerator.notes.description.empty()) {
      compu.open("DESC");
      compu.leaf("L-2 L=\"EN\"", enumerator.notes.description);
      compu.close();
    }
    if (!enumerator.notes.unit.empty()) {
      lost(label(type) + "." + enumerator.name, "its unit: " + enumerator.notes.unit, enumerator.place);
    }
    for (const auto& [key, text] : enumerator.notes.others) {
      lost(label(type) + "." + enumerator.name, "its annotation: " + key, enumerator.place);
    }
    compu.leaf("LOWER-LIMIT INTERVAL-TYPE=\"CLOSED\"", std::to_string(enumerator.value));
    compu.leaf("UPPER-LIMIT INTERVAL-TYPE=\"CLOSED\"", std::to_string(enumerator.value));
    compu.open("COMPU-CONST");
    compu.leaf("VT", enumerator.name);
    compu.close();
    compu.close();
  }
  compu.close();
  compu.close();
  compu.close();
  packages_.add(methods, method, compu.text());
  Xml xml;
  xml.open("STD-CPP-IMPLEMENTATION-DATA-TYPE");
  xml.leaf("SHORT-NAME", name);
  notes(xml, type.notes, "VALUE");
  number_properties(xml, type, name, methods + "/" + method);
  xml.close();
  packages_.add(package, name, xml.text());
  if (type.base != no_type) {
    lost(label(type), "that it extends another enumeration: the values are copied in", type.place);
  }
  if (type.backing && *type.backing != type.primitive) {
    lost(label(type), "its backing type", type.place);
  }
}

void Writer::write_type(TypeIndex index, std::uint32_t size, const std::string& path) {
  const Type& type = model_.at(index);
  const std::size_t slash = path.rfind('/');
  const std::string package = path.substr(0, slash);
  const std::string name = path.substr(slash + 1);
  if (type.kind == Kind::enumeration) {
    write_enumeration(type, package, name);
    return;
  }
  Xml xml;
  xml.open("STD-CPP-IMPLEMENTATION-DATA-TYPE");
  xml.leaf("SHORT-NAME", name);
  const auto template_argument = [&](const std::string& argument) {
    xml.open("CPP-TEMPLATE-ARGUMENT");
    xml.reference("TEMPLATE-TYPE-REF", "STD-CPP-IMPLEMENTATION-DATA-TYPE", argument);
    xml.close();
  };
  const std::string called = type.name.empty() ? name : full_name(type.scope, type.name);
  switch (type.kind) {
    case Kind::primitive:
      notes(xml, type.notes, "VALUE");
      number_properties(xml, type, name, {});
      break;
    case Kind::alias: {
      const Type& target = model_.at(representative(type.element.type));
      if (target.name.empty() && target.kind == Kind::primitive) {
        notes(xml, type.notes, "VALUE");
        number_properties(xml, target, name, {});
      } else if (target.name.empty() && target.kind == Kind::string) {
        notes(xml, type.notes, "STRING");
        if (size > 0) {
          xml.leaf("ARRAY-SIZE", std::to_string(size));
        }
      } else {
        notes(xml, type.notes, "TYPE_REFERENCE");
        xml.reference("TYPE-REFERENCE-REF", "STD-CPP-IMPLEMENTATION-DATA-TYPE",
                      path_of(type.element.type, size));
      }
      break;
    }
    case Kind::string: {
      notes(xml, type.notes, "STRING");
      if (size > 0) {
        xml.leaf("ARRAY-SIZE", std::to_string(size));
      }
      break;
    }
    case Kind::bytes:
    case Kind::array: {
      const bool fixed = type.fixed_size;
      notes(xml, type.notes, fixed ? "ARRAY" : "VECTOR");
      if (type.max_size > 0) {
        xml.leaf("ARRAY-SIZE", std::to_string(type.max_size));
      }
      std::string element;
      if (type.kind == Kind::bytes) {
        const std::string bytes = std::string{own} + "/Primitives";
        element = bytes + "/Byte";
        if (!packages_.has(bytes, "Byte")) {
          Xml byte;
          byte.open("STD-CPP-IMPLEMENTATION-DATA-TYPE");
          byte.leaf("SHORT-NAME", "Byte");
          byte.leaf("CATEGORY", "VALUE");
          number_properties(byte, {.kind = Kind::primitive}, "Byte", {});
          byte.close();
          packages_.add(bytes, "Byte", byte.text());
        }
      } else {
        element = path_of(type.element);
      }
      xml.open("TEMPLATE-ARGUMENTS");
      template_argument(element);
      xml.close();
      lose_units_in(type, called);
      if (type.min_size > 0 && !(fixed && type.min_size == type.max_size)) {
        lost(called, "its least number of elements", type.place);
      }
      break;
    }
    case Kind::map: {
      notes(xml, type.notes, "ASSOCIATIVE_MAP");
      if (type.max_size > 0) {
        xml.leaf("ARRAY-SIZE", std::to_string(type.max_size));
      }
      const std::string key = path_of(type.key);
      const std::string value = path_of(type.element);
      xml.open("TEMPLATE-ARGUMENTS");
      template_argument(key);
      template_argument(value);
      xml.close();
      lose_units_in(type, called);
      if (type.min_size > 0 && !(type.fixed_size && type.min_size == type.max_size)) {
        lost(called, "its least number of elements", type.place);
      }
      break;
    }
    case Kind::structure:
    case Kind::choice: {
      const bool is_choice = type.kind == Kind::choice;
      notes(xml, type.notes, is_choice ? "VARIANT" : "STRUCTURE");
      const std::vector<Value> members = all_members(model_, type);
      write_members(xml, members, path);
      if (is_choice && !members.empty()) {
        xml.open("TEMPLATE-ARGUMENTS");
        for (const Value& member : members) {
          template_argument(path_of(member));
        }
        xml.close();
      }
      if (type.base != no_type) {
        lost(called, "that it extends another type: the members are copied in", type.place);
      }
      if (!type.selectors.empty()) {
        lost(called, "its selectors: AUTOSAR counts from 1", type.place);
      }
      if (is_polymorphic(model_, type)) {
        lost(called, "that it is polymorphic", type.place);
      }
      break;
    }
    case Kind::enumeration:
      break;
  }
  xml.close();
  packages_.add(package, name, xml.text());
}

}  // namespace trestle::describe::arxml_writer
