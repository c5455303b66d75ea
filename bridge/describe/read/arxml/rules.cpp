#include "bridge/describe/read/arxml/rules.hpp"

#include <algorithm>
#include <set>

#include "bridge/describe/layout.hpp"
#include "bridge/describe/read/arxml/values.hpp"

namespace trestle::describe::arxml {

namespace {

template <typename T>
void fill(std::optional<T>& special, const std::optional<T>& general) {
  if (!special) {
    special = general;
  }
}

}  // namespace

Rules joined(const Rules& special, const Rules& general) {
  Rules rules = special;
  fill(rules.array, general.array);
  fill(rules.string, general.string);
  fill(rules.structure, general.structure);
  fill(rules.choice, general.choice);
  fill(rules.selector, general.selector);
  fill(rules.encoding, general.encoding);
  fill(rules.legacy_strings, general.legacy_strings);
  fill(rules.byte_order, general.byte_order);
  fill(rules.alignment_bytes, general.alignment_bytes);
  fill(rules.smallest_length, general.smallest_length);
  return rules;
}

namespace {

/// One property after the other, of Adaptive and of Classic names.
class RulesReader {
 public:
  RulesReader(const Node& properties, Problems& problems) : properties_{properties}, problems_{problems} {}

  [[nodiscard]] Rules read() {
    Rules rules;
    rules.array = width("SIZE-OF-ARRAY-LENGTH-FIELD"_tag, "SIZE-OF-ARRAY-LENGTH-FIELDS"_tag);
    rules.string = width("SIZE-OF-STRING-LENGTH-FIELD"_tag, "SIZE-OF-STRING-LENGTH-FIELDS"_tag);
    rules.structure = width("SIZE-OF-STRUCT-LENGTH-FIELD"_tag, "SIZE-OF-STRUCT-LENGTH-FIELDS"_tag);
    rules.choice = width("SIZE-OF-UNION-LENGTH-FIELD"_tag, "SIZE-OF-UNION-LENGTH-FIELDS"_tag);
    rules.selector = width("SIZE-OF-UNION-TYPE-SELECTOR-FIELD"_tag, "SIZE-OF-UNION-TYPE-SELECTOR-FIELDS"_tag);
    rules.encoding = encoding();
    rules.legacy_strings = boolean(properties_.child_text("IMPLEMENTS-LEGACY-STRING-SERIALIZATION"_tag));
    // Classic says the reverse in newer files.
    if (const auto handled = boolean(properties_.child_text("IMPLEMENTS-SOMEIP-STRING-HANDLING"_tag));
        handled && !rules.legacy_strings) {
      rules.legacy_strings = !*handled;
    }
    rules.byte_order = byte_order();
    rules.alignment_bytes = alignment();
    rules.smallest_length = boolean(properties_.child_text("IS-DYNAMIC-LENGTH-FIELD-SIZE"_tag));
    return rules;
  }

 private:
  [[nodiscard]] std::optional<someip::FieldWidth> width(Tag one, Tag many) {
    const Node* node = properties_.child(one);
    node = node == nullptr ? properties_.child(many) : node;
    if (node == nullptr) {
      return std::nullopt;
    }
    std::optional<std::int64_t> bytes = integer(node->text);
    if (bytes && (*bytes == 8 || *bytes == 16 || *bytes == 32)) {
      problems_.warning(node->place(), std::string{to_string(node->tag)} +
                                           " is in bytes: " + std::string{node->text} + " is taken for bits");
      *bytes /= 8;
    }
    if (!bytes || (*bytes != 0 && *bytes != 1 && *bytes != 2 && *bytes != 4)) {
      problems_.error(node->place(), std::string{to_string(node->tag)} + " is " + std::string{node->text} +
                                         ", and 0, 1, 2 or 4 was expected");
      return std::nullopt;
    }
    return static_cast<someip::FieldWidth>(*bytes);
  }

  [[nodiscard]] std::optional<someip::StringEncoding> encoding() {
    const Node* const node = properties_.child("STRING-ENCODING"_tag);
    if (node == nullptr) {
      return std::nullopt;
    }
    std::string name{node->text};
    std::erase(name, '-');
    std::erase(name, '_');
    std::ranges::transform(name, name.begin(), [](char letter) {
      return letter >= 'a' && letter <= 'z' ? static_cast<char>(letter - 'a' + 'A') : letter;
    });
    if (name == "UTF8" || name == "ASCII" || name == "USASCII") {
      return someip::StringEncoding::utf8;
    }
    if (name == "UTF16LE") {
      return someip::StringEncoding::utf16le;
    }
    if (name == "UTF16" || name == "UTF16BE") {
      return someip::StringEncoding::utf16be;
    }
    problems_.error(node->place(), "STRING-ENCODING is " + std::string{node->text} +
                                       ", and UTF-8, UTF-16LE or UTF-16BE was expected");
    return std::nullopt;
  }

  [[nodiscard]] std::optional<std::endian> byte_order() {
    const Node* const node = properties_.child("BYTE-ORDER"_tag);
    if (node == nullptr || node->text == "OPAQUE") {
      return std::nullopt;
    }
    if (node->text == "MOST-SIGNIFICANT-BYTE-FIRST") {
      return std::endian::big;
    }
    if (node->text == "MOST-SIGNIFICANT-BYTE-LAST") {
      return std::endian::little;
    }
    problems_.error(node->place(), "BYTE-ORDER is " + std::string{node->text} +
                                       ", and MOST-SIGNIFICANT-BYTE-FIRST or -LAST was expected");
    return std::nullopt;
  }

  [[nodiscard]] std::optional<std::uint8_t> alignment() {
    const Node* const node = properties_.child("ALIGNMENT"_tag);
    if (node == nullptr) {
      return std::nullopt;
    }
    const std::optional<std::int64_t> bits = integer(node->text);
    if (!bits || *bits < 0 || *bits > 256 || *bits % 8 != 0) {
      problems_.error(node->place(), "ALIGNMENT is " + std::string{node->text} +
                                         ", and a multiple of 8 bits up to 256 was expected");
      return std::nullopt;
    }
    return static_cast<std::uint8_t>(std::max<std::int64_t>(*bits / 8, 1));
  }

  const Node& properties_;
  Problems& problems_;
};

}  // namespace

Rules rules_of(const Node* properties, Problems& problems) {
  return properties == nullptr ? Rules{} : RulesReader{*properties, problems}.read();
}

Contexts::Contexts(const Tree& tree, Problems& problems) : tree_{tree}, problems_{problems} {
  for (const Node* const definition : tree.all("TLV-DATA-ID-DEFINITION"_tag)) {
    const Node* target = nullptr;
    for (const Tag reference : {"TLV-ARGUMENT-REF"_tag, "TLV-IMPLEMENTATION-DATA-TYPE-ELEMENT-REF"_tag,
                                "TLV-RECORD-ELEMENT-REF"_tag, "TLV-SUB-ELEMENT-REF"_tag}) {
      target = target == nullptr ? tree.follow(definition, reference) : target;
    }
    const std::optional<std::int64_t> id = integer(definition->child_text("ID"_tag));
    if (!id || *id < 0 || *id > someip::max_data_id) {
      problems.error(definition->place(), "the ID of a TLV-DATA-ID-DEFINITION is \"" +
                                              std::string{definition->child_text("ID"_tag)} +
                                              "\", and a number from 0 to 4095 was expected");
    } else if (target == nullptr) {
      problems.warning(definition->place(), "this TLV data id is of something that is in none of the files");
    } else {
      const Node* const set = definition->above("TLV-DATA-ID-DEFINITION-SET"_tag);
      sets_[set].emplace(target, static_cast<someip::DataId>(*id));
      all_tags_.emplace(target, static_cast<someip::DataId>(*id));
    }
  }
  for (const Node* const mapping :
       tree.all("TRANSFORMATION-PROPS-TO-SERVICE-INTERFACE-ELEMENT-MAPPING"_tag)) {
    read_mapping(*mapping);
  }
  for (const Node* const properties : tree.all("SOMEIP-DATA-PROTOTYPE-TRANSFORMATION-PROPS"_tag)) {
    read_prototype_rules(*properties);
  }
}

void Contexts::read_mapping(const Node& mapping) {
  Context context;
  context.rules = rules_of(tree_.follow(&mapping, "TRANSFORMATION-PROPS-REF"_tag), problems_);
  each_in(&mapping, "TLV-DATA-ID-DEFINITION-REFS"_tag, "TLV-DATA-ID-DEFINITION-REF"_tag,
          [&](const Node& reference) {
            if (const Node* const set = tree_.resolve(reference); set != nullptr) {
              context.tag_sets.push_back(set);
            }
          });
  const auto apply = [&](const Node& reference) {
    if (const Node* const prototype = tree_.resolve(reference); prototype != nullptr) {
      Context& known = contexts_[prototype];
      known.rules = joined(known.rules, context.rules);
      known.tag_sets.insert(known.tag_sets.end(), context.tag_sets.begin(), context.tag_sets.end());
    } else {
      problems_.warning(reference.place(), "\"" + std::string{reference.text} +
                                               "\", which these properties are for, is in none of the files");
    }
  };
  each_in(&mapping, "EVENT-REFS"_tag, "EVENT-REF"_tag, apply);
  each_in(&mapping, "FIELD-REFS"_tag, "FIELD-REF"_tag, apply);
  each_in(&mapping, "METHOD-REFS"_tag, "METHOD-REF"_tag, apply);
}

const Node* read_way(const Tree& tree, const Node& instance, Override& into, Problems& problems) {
  const Node* root = nullptr;
  const auto step = [&](const Node& reference) {
    const Node* const named = tree.resolve(reference);
    if (named == nullptr) {
      problems.warning(reference.place(), "\"" + std::string{reference.text} + "\" is in none of the files");
      return;
    }
    const std::string_view tag = to_string(reference.tag);
    if (tag.starts_with("ROOT")) {
      root = named;
    } else if (tag.starts_with("CONTEXT")) {
      into.through.push_back(named);
    } else if (tag.starts_with("TARGET")) {
      into.target = named;
    }
  };
  for (const Node* node = instance.first_child; node != nullptr; node = node->next) {
    if (node->first_child == nullptr) {
      step(*node);
    }
    for (const Node* inner = node->first_child; inner != nullptr; inner = inner->next) {
      step(*inner);
    }
  }
  root = root == nullptr ? into.target : root;
  into.target = into.target == nullptr ? root : into.target;
  return root;
}

void Contexts::read_prototype_rules(const Node& properties) {
  Override special;
  const Node* const transformation = tree_.follow(&properties, "SOMEIP-TRANSFORMATION-PROPS-REF"_tag);
  special.rules = rules_of(transformation, problems_);
  special.representation = properties.down("NETWORK-REPRESENTATION"_tag, "SW-DATA-DEF-PROPS-VARIANTS"_tag,
                                           "SW-DATA-DEF-PROPS-CONDITIONAL"_tag);
  const auto apply = [&](const Node& instance) {
    Override here = special;
    const Node* const root = read_way(tree_, instance, here, problems_);
    if (root != nullptr) {
      contexts_[root].overrides.push_back(std::move(here));
    }
  };
  each_in(&properties, "DATA-PROTOTYPES"_tag, "DATA-PROTOTYPE-IN-SERVICE-INTERFACE-REF"_tag,
          [&](const Node& reference) {
            each_child(&reference, "DATA-PROTOTYPE-IREF"_tag, apply);
            each_child(&reference, "ELEMENT-IN-IMPL-DATATYPE"_tag, apply);
          });
}

const Context& Contexts::of(const Node* prototype) const {
  const auto found = contexts_.find(prototype);
  return found == contexts_.end() ? none_ : found->second;
}

const Tags& Contexts::tags_of(const Node* set) const {
  static const Tags none;
  const auto found = sets_.find(set);
  return found == sets_.end() ? none : found->second;
}

std::optional<someip::DataId> Contexts::tag(const Context& context, const Node* member) const {
  for (const Node* const set : context.tag_sets) {
    const Tags& tags = tags_of(set);
    if (const auto found = tags.find(member); found != tags.end()) {
      return found->second;
    }
  }
  // Definitions that no mapping names are meant for all.
  const auto found = context.tag_sets.empty() ? all_tags_.find(member) : all_tags_.end();
  return found == all_tags_.end() ? std::nullopt : std::optional{found->second};
}

void Contexts::fill(Payload& payload, const Context& context) const {
  const Rules& rules = context.rules;
  payload.byte_order = rules.byte_order.value_or(std::endian::big);
  // [feat_req_someip_675]
  payload.length_fields_always_big = payload.byte_order == std::endian::little;
  payload.alignment = rules.alignment_bytes.value_or(1);
  payload.smallest_tagged_length = rules.smallest_length.value_or(false);
}

void find_tagged_lengths(Model& model, Problems& problems) {
  const auto find = [&](const Service& service, const auto& element, Payload& payload) {
    const std::set<someip::FieldWidth> widths = tagged_widths(model, payload);
    if (widths.size() == 1) {
      payload.tagged_length = *widths.begin();
    } else if (widths.size() > 1 && !payload.smallest_tagged_length) {
      std::string all;
      for (const someip::FieldWidth width : widths) {
        all += (all.empty()                 ? ""
                : width == *widths.rbegin() ? " and "
                                            : ", ") +
               std::to_string(someip::bytes(width));
      }
      problems.warning(element.place,
                       "the members with TLV data ids in " + full_name(service.scope, service.name) +
                           (service.scope.starts_with('/') ? "/" : ".") + element.name +
                           " have length fields of " + all +
                           " bytes, and only one width for all of them can be carried: what it carries is "
                           "left out. Give strings, arrays, structures and unions the same "
                           "SIZE-OF-…-LENGTH-FIELD, or set IS-DYNAMIC-LENGTH-FIELD-SIZE");
      payload.known = false;
      payload.values.clear();
    }
  };
  for (Service& service : model.services) {
    for (Event& event : service.events) {
      find(service, event, event.payload);
    }
    for (Method& method : service.methods) {
      find(service, method, method.request);
      find(service, method, method.response);
    }
    for (Field& field : service.fields) {
      find(service, field, field.payload);
    }
  }
}

}  // namespace trestle::describe::arxml
