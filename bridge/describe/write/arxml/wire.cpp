#include <algorithm>
#include <utility>

#include "bridge/describe/write/arxml/writer.hpp"

namespace trestle::describe::arxml_writer {

namespace {

constexpr int max_depth = 64;
constexpr std::uint8_t usual_length = 4;  ///< bytes of a length field that no rule tells

[[nodiscard]] std::uint8_t bytes_of(someip::FieldWidth width) noexcept {
  return static_cast<std::uint8_t>(someip::bytes(width));
}

}  // namespace

/// Decides rules by what is needed first, and gives all else rules of its own.
void Writer::need(const Value& value, Needs& needs, std::vector<Prototype>& way, int depth) {
  Special special;
  if (const auto width = tagged_length(value, needs)) {
    Value tagged{.type = value.type, .wire = value.wire, .place = value.place};
    tagged.wire.length = *width;
    need_inside(tagged, needs, way, special, depth);
  } else {
    need_inside(value, needs, way, special, depth);
  }
  if (special.rules == Rules{}) {
    return;
  }
  if (special_count_ >= max_special_rules) {
    needs.cut = "elements in it with rules of their own: there are too many";
    return;
  }
  special_count_ += way.size();
  special.way = way;
  special.met.clear();
  special.arrays.clear();
  needs.special.push_back(std::move(special));
}

/// Of an element in a payload. Each way to it is another one, and there may be very many.
void Writer::lost_inside(Needs& needs, const std::string& element, std::string what, Place place) {
  if (special_count_ >= max_special_rules) {
    needs.cut = "elements in it with rules of their own: there are too many";
    return;
  }
  ++special_count_;
  lost(element, std::move(what), place);
}

/// The length field that stands before a tagged member, in place of that of its type; nothing: none does, the
/// tag tells it, or a length field would make a string of fixed size one of any.
std::optional<someip::FieldWidth> Writer::tagged_length(const Value& value, Needs& needs) const {
  needs.has_tags = needs.has_tags || value.tag.has_value();
  const Kind kind = resolved(model_, value.type).kind;
  if (!value.tag || kind == Kind::primitive || kind == Kind::enumeration) {
    return std::nullopt;
  }
  needs.has_tagged_lengths = true;
  if (value.wire.length == someip::FieldWidth::none && value.wire.fixed_bytes != 0) {
    return std::nullopt;
  }
  needs.says_tagged_length = needs.tagged_length.has_value();
  return needs.tagged_length;
}

/// What is inside a structure or choice.
void Writer::need_members(const Value& value, const Type& type, Needs& needs, std::vector<Prototype>& way,
                          int depth) {
  if (needs.plain.contains(&type)) {
    return;
  }
  if (!needs.open.insert(&type).second) {
    return;  // it contains itself: each of its rules would be there without end
  }
  const std::size_t special_before = needs.special.size();
  const std::size_t lost_before = file_.not_carried.size();
  // Behind an alias, members are those of the type it stands for.
  TypeIndex target = representative(value.type);
  for (std::size_t steps = 0; model_.at(target).kind == Kind::alias && steps < max_type_nesting; ++steps) {
    target = representative(model_.at(target).element.type);
  }
  const std::string holder = path_of(Value{.type = target});
  for (const Value& member : all_members(model_, type)) {
    const auto name = members_.find({holder, member.name});
    way.push_back({holder + "/" + (name == members_.end() ? short_name(member.name) : name->second),
                   "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT"});
    need(member, needs, way, depth + 1);
    way.pop_back();
  }
  needs.open.erase(&type);
  if (needs.special.size() == special_before && file_.not_carried.size() == lost_before) {
    needs.plain.insert(&type);
  }
}

void Writer::need_inside(const Value& value, Needs& needs, std::vector<Prototype>& way, Special& special,
                         int depth) {
  if (depth > max_depth || needs.cut != nullptr || value.type == no_type) {
    return;
  }
  if (++needs.steps > max_rule_steps || ++rule_steps_ > max_rule_steps_of_all) {
    needs.cut = "the rules of the rest of its elements: there are too many to look at";
    return;
  }
  const Type& type = resolved(model_, value.type);
  const std::string where = way.empty() ? std::string{} : way.back().path;
  const auto choose = [&](const char* key, auto& base, auto& own_rule, auto wanted, auto unsaid) {
    if (!needs.decided[key]) {
      needs.decided[key] = true;
      needs.plain.clear();  // of what was decided
      if (wanted != unsaid) {
        base = wanted;
      }
    } else if (own_rule ? *own_rule != wanted
                        : base.value_or(unsaid) != wanted && special.met.contains(key)) {
      // A rule of its own holds for all that is in the element, also for what was met before.
      lost_inside(needs, where, std::string{"that elements in it have another rule of their own: "} + key,
                  value.place);
    } else if (base.value_or(unsaid) != wanted) {
      own_rule = wanted;
    }
    special.met.insert(key);
  };
  const std::uint8_t length = bytes_of(value.wire.length);
  constexpr std::uint8_t no_field = 0;
  if (value.wire.bits != 0) {
    lost_inside(needs, where, "its " + std::to_string(value.wire.bits) + " bits", value.place);
  }
  if (value.wire.byte_order) {
    special.rules.byte_order = value.wire.byte_order;
  }
  const auto inner_members = [&] { need_members(value, type, needs, way, depth); };
  switch (type.kind) {
    case Kind::string:
      choose("string length", needs.base.string, special.rules.string, length, usual_length);
      if (value.wire.bom != value.wire.terminator) {
        lost_inside(needs, where, "that its strings have only one of BOM and terminator", value.place);
      }
      choose("string encoding", needs.base.encoding, special.rules.encoding, value.wire.encoding,
             someip::StringEncoding::utf8);
      choose("legacy strings", needs.base.legacy, special.rules.legacy, !value.wire.bom, false);
      break;
    case Kind::bytes:
    case Kind::array:
    case Kind::map: {
      // One property for all: without it, arrays of fixed size have no length field, and all else has 4
      // bytes.
      const std::uint8_t unsaid = type.fixed_size && type.kind != Kind::map ? no_field : usual_length;
      std::optional<std::uint8_t>& own_rule = special.rules.array;
      if (!std::exchange(needs.decided["array length"], true)) {
        needs.plain.clear();
        if (length != unsaid) {
          needs.base.array = length;
        }
      }
      const bool is_other = needs.base.array.value_or(unsaid) != length;
      const bool others_differ = std::ranges::any_of(special.arrays, [&](auto one) { return one != length; });
      if (own_rule ? *own_rule != length : is_other && others_differ) {
        // A rule of its own holds for all that is in the element, also for what was met before.
        lost_inside(needs, where, "that arrays in it have another length field", value.place);
      } else if (is_other) {
        own_rule = length;
      }
      special.arrays.insert(length);
      if (type.kind == Kind::bytes) {
        break;
      }
      if (type.kind == Kind::map) {
        need_inside(type.key, needs, way, special, depth + 1);
      }
      need_inside(type.element, needs, way, special, depth + 1);
      break;
    }
    case Kind::structure:
      choose("structure length", needs.base.structure, special.rules.structure, length, no_field);
      inner_members();
      break;
    case Kind::choice:
      choose("union length", needs.base.choice, special.rules.choice, length, usual_length);
      choose("type selector", needs.base.selector, special.rules.selector, bytes_of(value.wire.selector),
             usual_length);
      if (!value.wire.length_first) {
        lost_inside(needs, where, "that the selector of its union is before the length", value.place);
      }
      if (value.wire.fixed_bytes > 0) {
        lost_inside(needs, where, "the fixed size of its union", value.place);
      }
      inner_members();
      break;
    case Kind::primitive:
    case Kind::enumeration:
    case Kind::alias:
      break;
  }
}

std::string Writer::rules_path(const Rules& rules) {
  const std::string set = std::string{own} + "/Wire/Properties/";
  const auto [known, is_new] = rule_names_.try_emplace(rules);
  if (is_new) {
    known->second = "Rules" + std::to_string(rules_.size() + 1);
    rules_.emplace_back(rules, known->second);
  }
  return set + known->second;
}

void Writer::write_rules() {
  if (rules_.empty()) {
    return;
  }
  Xml xml;
  xml.open("TRANSFORMATION-PROPS-SET");
  xml.leaf("SHORT-NAME", "Properties");
  xml.open("TRANSFORMATION-PROPSS");
  for (const auto& [rules, name] : rules_) {
    xml.open("AP-SOMEIP-TRANSFORMATION-PROPS");
    xml.leaf("SHORT-NAME", name);
    const auto width = [&](const char* tag, const std::optional<std::uint8_t>& bytes) {
      if (bytes) {
        xml.leaf(tag, std::to_string(*bytes));
      }
    };
    if (rules.alignment_bytes) {
      xml.leaf("ALIGNMENT", std::to_string(*rules.alignment_bytes * 8));
    }
    if (rules.byte_order) {
      xml.leaf("BYTE-ORDER", *rules.byte_order == std::endian::big ? "MOST-SIGNIFICANT-BYTE-FIRST"
                                                                   : "MOST-SIGNIFICANT-BYTE-LAST");
    }
    if (rules.legacy) {
      xml.leaf("IMPLEMENTS-LEGACY-STRING-SERIALIZATION", *rules.legacy ? "true" : "false");
    }
    if (rules.smallest) {
      xml.leaf("IS-DYNAMIC-LENGTH-FIELD-SIZE", *rules.smallest ? "true" : "false");
    }
    width("SIZE-OF-ARRAY-LENGTH-FIELD", rules.array);
    width("SIZE-OF-STRING-LENGTH-FIELD", rules.string);
    width("SIZE-OF-STRUCT-LENGTH-FIELD", rules.structure);
    width("SIZE-OF-UNION-LENGTH-FIELD", rules.choice);
    width("SIZE-OF-UNION-TYPE-SELECTOR-FIELD", rules.selector);
    if (rules.encoding) {
      xml.leaf("STRING-ENCODING", *rules.encoding == someip::StringEncoding::utf8      ? "UTF-8"
                                  : *rules.encoding == someip::StringEncoding::utf16le ? "UTF-16LE"
                                                                                       : "UTF-16BE");
    }
    xml.close();
  }
  xml.close();
  xml.close();
  packages_.add(std::string{own} + "/Wire", "Properties", xml.text());
}

void Writer::write_tag(std::optional<someip::DataId> tag, std::string_view reference, std::string_view dest,
                       const std::string& path) {
  if (!tag || !tagged_.emplace(path, "").second) {
    return;
  }
  Xml xml;
  xml.open("TLV-DATA-ID-DEFINITION");
  xml.leaf("ID", std::to_string(static_cast<unsigned>(*tag)));
  xml.reference(reference, dest, path);
  xml.close();
  tags_.push_back(xml.text());
}

void Writer::write_tags() {
  if (tags_.empty()) {
    return;
  }
  Xml xml;
  xml.open("TLV-DATA-ID-DEFINITION-SET");
  xml.leaf("SHORT-NAME", "Tags");
  xml.open("TLV-DATA-ID-DEFINITIONS");
  for (const std::string& tag : tags_) {
    xml.raw(tag);
  }
  xml.close();
  xml.close();
  packages_.add(std::string{own} + "/Wire", "Tags", xml.text());
}

void Writer::write_wire(const Service& service, const std::string& service_path, const std::string& element,
                        std::string_view list, std::string_view reference, std::string_view dest,
                        const std::vector<std::pair<Prototype, const Value*>>& values,
                        const Payload& payload) {
  Needs needs;
  if (payload.byte_order == std::endian::little) {
    needs.base.byte_order = std::endian::little;
  }
  if (payload.alignment > 1) {
    needs.base.alignment_bytes = payload.alignment;
  }
  if (payload.smallest_tagged_length) {
    needs.base.smallest = true;
  } else if (payload.tagged_length != someip::FieldWidth::none) {
    needs.tagged_length = payload.tagged_length;
  }
  needs.decided["structure length"] = root_.has_value();  // none before the structure around the arguments
  for (const auto& [prototype, value] : values) {
    std::vector<Prototype> way;
    if (root_) {
      way.push_back(*root_);
    }
    way.push_back(prototype);
    need(*value, needs, way, 0);
  }
  if (needs.cut != nullptr) {
    lost(service.name + "." + element, needs.cut, service.place);
  }
  const std::string package = std::string{own} + "/Wire";
  const std::string base_name = service.name + "_" + element;
  if (needs.has_tagged_lengths && !payload.smallest_tagged_length && !needs.says_tagged_length &&
      payload.tagged_length != someip::FieldWidth::bits32) {
    lost(base_name, "the width of length fields before tagged members", service.place);
  }
  if (!(needs.base == Rules{}) || needs.has_tags) {
    const std::string name = packages_.unique(package, base_name);
    Xml xml;
    xml.open("TRANSFORMATION-PROPS-TO-SERVICE-INTERFACE-ELEMENT-MAPPING");
    xml.leaf("SHORT-NAME", name);
    xml.open(list);
    xml.reference(reference, dest, service_path + "/" + element);
    xml.close();
    if (needs.has_tags) {
      xml.open("TLV-DATA-ID-DEFINITION-REFS");
      xml.reference("TLV-DATA-ID-DEFINITION-REF", "TLV-DATA-ID-DEFINITION-SET", package + "/Tags");
      xml.close();
    }
    xml.reference("TRANSFORMATION-PROPS-REF", "AP-SOMEIP-TRANSFORMATION-PROPS", rules_path(needs.base));
    xml.close();
    packages_.add(package, name, xml.text());
  }
  for (const Special& special : needs.special) {
    const std::string name = packages_.unique(package, base_name + "_own");
    Xml xml;
    xml.open("SOMEIP-DATA-PROTOTYPE-TRANSFORMATION-PROPS");
    xml.leaf("SHORT-NAME", name);
    xml.open("DATA-PROTOTYPES");
    xml.open("DATA-PROTOTYPE-IN-SERVICE-INTERFACE-REF");
    const Prototype& root = special.way.front();
    if (special.way.size() == 1) {
      xml.open("DATA-PROTOTYPE-IREF");
      xml.reference("TARGET-DATA-PROTOTYPE-REF", root.dest, root.path);
      xml.close();
    } else {
      xml.open("ELEMENT-IN-IMPL-DATATYPE");
      if (special.way.size() > 2) {
        xml.open("CONTEXT-DATA-PROTOTYPE-REFS");
        for (std::size_t i = 1; i + 1 < special.way.size(); ++i) {
          xml.reference("CONTEXT-DATA-PROTOTYPE-REF", special.way[i].dest, special.way[i].path);
        }
        xml.close();
      }
      xml.reference("ROOT-DATA-PROTOTYPE-REF", root.dest, root.path);
      xml.reference("TARGET-DATA-PROTOTYPE-REF", special.way.back().dest, special.way.back().path);
      xml.close();
    }
    xml.close();
    xml.close();
    xml.reference("SOMEIP-TRANSFORMATION-PROPS-REF", "AP-SOMEIP-TRANSFORMATION-PROPS",
                  rules_path(special.rules));
    xml.close();
    packages_.add(package, name, xml.text());
  }
}

}  // namespace trestle::describe::arxml_writer
