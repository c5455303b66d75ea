#include "bridge/describe/write/fidl/deployment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <type_traits>
#include <utility>

#include "bridge/describe/address_text.hpp"
#include "bridge/describe/layout.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe::fidl_writing {
namespace {

unsigned wide(someip::FieldWidth width) {
  return static_cast<unsigned>(width);
}

const char* word(someip::StringEncoding encoding) {
  return encoding == someip::StringEncoding::utf8      ? "utf8"
         : encoding == someip::StringEncoding::utf16le ? "utf16le"
                                                       : "utf16be";
}

bool is_basic(const Type& type) {
  return type.kind == Kind::primitive || type.kind == Kind::string || type.kind == Kind::bytes;
}

/// Has a fixed size and a length field all the same: there is no key for that.
bool is_counted(const Type& type, const Wire& wire) {
  return type.fixed_size && wire.length != someip::FieldWidth::none;
}

template <typename Number>
void set(Block& block, const char* key, Number now, Number before) {
  if (now != before) {
    block.settings.push_back(fmt::format("{} = {}", key, now));
  }
}

void set_width(Block& block, const char* key, someip::FieldWidth now, someip::FieldWidth before) {
  set(block, key, wide(now), wide(before));
}

template <typename Id>
std::string listed(const std::vector<Id>& ids) {
  std::string all;
  for (const Id id : ids) {
    all += fmt::format("{}{}", all.empty() ? "" : ", ", static_cast<unsigned>(id));
  }
  return "{ " + all + " }";
}

/// "KEY = 17", with a note where nobody gave this id.
template <typename Id>
std::string id_setting(const char* key, Id id, bool is_chosen) {
  return fmt::format("{} = {}{}", key, static_cast<unsigned>(id),
                     is_chosen ? fmt::format("  // {}", chosen_id_note) : "");
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    result += c == '"' || c == '\\' ? "\\" : "";
    result += c;
  }
  return result + '"';
}

std::string selector(const std::string& name) {
  return name.empty() ? "" : ":" + escaped_fdepl(usable(name, false));
}

std::string backing_name(messages::Primitive primitive) {
  return basic_name({.kind = Kind::primitive, .primitive = primitive});
}

}  // namespace

std::string text_of(const Block& block, int indent) {
  const std::string margin(static_cast<std::size_t>(indent) * 4, ' ');
  std::string text = margin + block.head + " {\n";
  for (const std::string& setting : block.settings) {
    text += margin + "    " + setting + "\n";
  }
  for (const Block& child : block.children) {
    text += text_of(child, indent + 1);
  }
  return text + margin + "}\n";
}

void Deployment::kept(Block& block, const Notes& notes, std::initializer_list<const char*> keys,
                      const std::string& owner) {
  for (const auto& [key, value] : notes.others) {
    if (key.starts_with('@')) {
      continue;
    }
    if (std::ranges::find(keys, key) != keys.end()) {
      block.settings.push_back(fmt::format("{} = {}", key, value));
    } else {
      lose(owner, fmt::format("{} = {}", key, value));
    }
  }
}

void Deployment::array(Block& block, const Type& now, const Wire& wire, const Type& before,
                       const Wire& wire_before, const std::string& owner) {
  set_width(block, "SomeIpArrayLengthWidth", wire.length, wire_before.length);
  const auto least = [](const Type& type) { return type.fixed_size ? 0U : type.min_size; };
  set(block, "SomeIpArrayMinLength", least(now), least(before));
  set(block, "SomeIpArrayMaxLength", now.max_size, before.max_size);
  if (is_counted(now, wire) && !is_counted(before, wire_before)) {
    lose(owner, "the fixed size of an array with a length field", now.place);
  }
}

void Deployment::elements(Block& block, const Value& now, const Value* before, User user,
                          const std::string& owner) {
  Block inner;
  use(inner, now, before, user, owner);
  // "#" would be said of the outer array.
  if (std::erase_if(inner.children, [](const Block& child) { return child.head == "#"; }) > 0) {
    lose(owner, "rules of arrays in an array that hold for this use alone", now.place);
  }
  std::ranges::move(inner.settings, std::back_inserter(block.settings));
  std::ranges::move(inner.children, std::back_inserter(block.children));
}

void Deployment::basic(Block& block, const Value& now, const Value* before, const std::string& owner) {
  const Type& type = resolved(model_, now.type);
  Type plain{.kind = type.kind, .primitive = type.primitive};
  const Type& old = before == nullptr ? plain : resolved(model_, before->type);
  const Wire wire_before = before == nullptr ? default_wire(type.kind) : before->wire;
  if (type.kind == Kind::string) {
    const auto length = [](const Type& one, const Wire& wire) {
      return wire.length == someip::FieldWidth::none ? wire.fixed_bytes : one.max_size;
    };
    set_width(block, "SomeIpStringLengthWidth", now.wire.length, wire_before.length);
    set(block, "SomeIpStringLength", length(type, now.wire), length(old, wire_before));
    set(block, "SomeIpStringEncoding", std::string_view{word(now.wire.encoding)},
        std::string_view{word(wire_before.encoding)});
    if (!now.wire.bom || !now.wire.terminator) {
      lose(owner, "a string without BOM or terminator", now.place);
    }
  } else if (type.kind == Kind::bytes) {
    const auto least = [](const Type& one) { return one.fixed_size ? 0U : one.min_size; };
    set_width(block, "SomeIpByteBufferLengthWidth", now.wire.length, wire_before.length);
    set(block, "SomeIpByteBufferMinLength", least(type), least(old));
    set(block, "SomeIpByteBufferMaxLength", type.max_size, old.max_size);
    if (is_counted(type, now.wire) && !is_counted(old, wire_before)) {
      lose(owner, "the fixed size of a byte buffer with a length field", now.place);
    }
  } else {
    set(block, "SomeIpIntegerBitWidth", static_cast<unsigned>(now.wire.bits),
        static_cast<unsigned>(wire_before.bits));
    if (type.invalid_value && type.invalid_value != old.invalid_value) {
      block.settings.push_back(fmt::format("SomeIpIntegerInvalidValue = {}", *type.invalid_value));
    }
    if ((type.minimum || type.maximum) && type.primitive != messages::Primitive::int32) {
      lose(owner, "limits of an integer that is not Int32", now.place);
    }
  }
}

void Deployment::use(Block& block, const Value& now, const Value* before, User user,
                     const std::string& owner) {
  if (now.tag) {
    lose(owner, "a data id (TLV)", now.place);
  }
  if (now.optional) {
    lose(owner, "an optional member", now.place);
  }
  if (!now.default_value.empty()) {
    lose(owner, "a default value", now.place);
  }
  if (now.wire.byte_order) {
    lose(owner, "a byte order of its own", now.place);
  }
  if (plan_.is_left_out(now.type)) {
    lose(owner, "a use of a type without content", now.place);
    return;
  }
  const Type& type = model_.at(now.type);
  if (plan_.is_inline(now.type)) {
    const bool has_before = before != nullptr && model_.at(before->type).kind == Kind::array;
    const Type plain{.kind = Kind::array};
    array(block, type, now.wire, has_before ? model_.at(before->type) : plain,
          has_before ? before->wire : default_wire(Kind::array), owner);
    elements(block, type.element, has_before ? &model_.at(before->type).element : nullptr, user, owner);
  } else if (is_basic(resolved(model_, now.type))) {
    basic(block, now, before, owner);
  } else {
    named(block, now, before, user, owner);
  }
}

/// FDEPL says it of a declared type in an overwrite.
void Deployment::named(Block& block, const Value& now, const Value* before, User user,
                       const std::string& owner) {
  const Type& type = resolved(model_, now.type);
  const Type& declared =
      model_.at(plan_.root(TypeIndex{static_cast<std::uint32_t>(&type - model_.types.data())}));
  const Type& old = before == nullptr ? declared : resolved(model_, before->type);
  const Wire& wire_before = before == nullptr ? declared.wire : before->wire;
  Block overwrite;
  switch (type.kind) {
    case Kind::structure:
    case Kind::choice: {
      const bool is_structure = type.kind == Kind::structure;
      const TypeIndex index{static_cast<std::uint32_t>(&type - model_.types.data())};
      overwrite.head = is_structure ? "#struct" : "#union";
      // A type differs in nothing from itself; else members are copied.
      const bool is_same = &type == &old;
      const std::vector<Value> members = is_same ? std::vector<Value>{} : all_members(model_, type);
      const std::vector<Value> old_members = is_same ? std::vector<Value>{} : all_members(model_, old);
      if (!is_same && ++overwrites_ > max_overwrites) {
        lose(owner, "rules of members for this use alone: there are too many", now.place);
        return;
      }
      for (std::size_t i = 0; i < members.size() && i < old_members.size(); ++i) {
        if (plan_.is_left_out(members[i].type)) {
          continue;
        }
        Block member{.head = escaped_fdepl(plan_.member_name(index, members[i].name))};
        if (members[i].type != old_members[i].type || members[i].wire != old_members[i].wire) {
          use(member, members[i], &old_members[i], User::field, owner + "." + members[i].name);
        }
        overwrite.add(std::move(member));
      }
      if (is_structure) {
        // Without it CommonAPI would take 0.
        if (!overwrite.is_empty() ? now.wire.length != someip::FieldWidth::none ||
                                        wire_before.length != someip::FieldWidth::none
                                  : now.wire.length != wire_before.length) {
          overwrite.settings.push_back(fmt::format("SomeIpStructLengthWidth = {}", wide(now.wire.length)));
        }
      } else {
        set_width(overwrite, "SomeIpUnionLengthWidth", now.wire.length, wire_before.length);
        set_width(overwrite, "SomeIpUnionTypeWidth", now.wire.selector, wire_before.selector);
        set(overwrite, "SomeIpUnionDefaultOrder", now.wire.length_first, wire_before.length_first);
        set(overwrite, "SomeIpUnionMaxLength", now.wire.fixed_bytes, wire_before.fixed_bytes);
      }
      break;
    }
    case Kind::enumeration:
      overwrite.head = "#enumeration";
      set(overwrite, "SomeIpEnumWidth", unsigned{messages::width(type.primitive)},
          unsigned{messages::width(old.primitive)});
      set(overwrite, "SomeIpEnumBitWidth", static_cast<unsigned>(now.wire.bits),
          static_cast<unsigned>(wire_before.bits));
      if (type.invalid_value && type.invalid_value != old.invalid_value) {
        overwrite.settings.push_back(fmt::format("SomeIpEnumInvalidValue = {}", *type.invalid_value));
      }
      break;
    case Kind::array:
      overwrite.head = "#";
      array(overwrite, type, now.wire, old, wire_before, owner);
      if (type.element.type != old.element.type || type.element.wire != old.element.wire) {
        Block inner;
        elements(inner, type.element, &old.element, user, owner);
        if (overwrite.is_empty() && inner.children.size() == 1 && inner.settings.empty()) {
          overwrite = std::move(inner.children.front());
        } else if (!inner.is_empty()) {
          lose(owner, "rules of the elements of a declared array that hold for this use alone", now.place);
        }
      }
      break;
    case Kind::map: {
      const bool differs = now.wire.length != wire_before.length || type.min_size != old.min_size ||
                           type.max_size != old.max_size ||
                           (before == nullptr && now.wire != default_wire(Kind::map)) ||
                           (before == nullptr && (type.min_size != 0 || type.max_size != 0));
      if (!differs) {
        break;
      }
      if (user != User::attribute && user != User::argument) {
        lose(owner, "the length field or limits of a map that is no attribute or argument", now.place);
        break;
      }
      const std::string stem = user == User::attribute ? "SomeIpAttrMap" : "SomeIpArgMap";
      block.settings.push_back(fmt::format("{}LengthWidth = {}", stem, wide(now.wire.length)));
      if (type.min_size != 0 && !type.fixed_size) {
        block.settings.push_back(fmt::format("{}MinLength = {}", stem, type.min_size));
      }
      if (type.max_size != 0) {
        block.settings.push_back(fmt::format("{}MaxLength = {}", stem, type.max_size));
      }
      break;
    }
    case Kind::primitive:
    case Kind::string:
    case Kind::bytes:
    case Kind::alias:
      break;
  }
  if (user == User::map_part && !overwrite.is_empty()) {
    lose(owner, "rules of a key or value of a map that its type does not have", now.place);
    return;
  }
  block.add(std::move(overwrite));
}

Block Deployment::type(TypeIndex index) {
  const Type& type = model_.at(index);
  const Declared& declared = *plan_.declared(index);
  const std::string owner = full_name(type.scope, type.name);
  place_ = type.place;
  Block block;
  const auto head = [&](const char* word) {
    block.head = fmt::format("{} {}", word, escaped_fdepl(declared.name));
  };
  switch (type.kind) {
    case Kind::array:
      head("array");
      array(block, type, type.wire, {.kind = Kind::array}, default_wire(Kind::array), owner);
      if (!is_basic(resolved(model_, type.element.type))) {
        elements(block, type.element, nullptr, User::field, owner);
      } else {
        Block inner;
        basic(inner, type.element, nullptr, owner);
        if (!inner.is_empty()) {
          lose(owner, "rules of the elements of an array that cannot be written T[]", type.place);
        }
      }
      break;
    case Kind::structure:
    case Kind::choice:
      head(type.kind == Kind::structure ? "struct" : "union");
      if (type.kind == Kind::structure) {
        set_width(block, "SomeIpStructLengthWidth", type.wire.length, someip::FieldWidth::none);
      } else {
        set_width(block, "SomeIpUnionLengthWidth", type.wire.length, someip::FieldWidth::bits32);
        set_width(block, "SomeIpUnionTypeWidth", type.wire.selector, someip::FieldWidth::bits32);
        set(block, "SomeIpUnionDefaultOrder", type.wire.length_first, true);
        set(block, "SomeIpUnionMaxLength", type.wire.fixed_bytes, 0U);
        for (std::size_t i = 0; i < type.selectors.size(); ++i) {
          if (type.selectors[i] != i + 1) {
            lose(owner, "selectors of a union other than 1, 2, 3 …", type.place);
            break;
          }
        }
      }
      for (const Value& member : type.members) {
        Block field{.head = escaped_fdepl(plan_.member_name(index, member.name))};
        use(field, member, nullptr, User::field, owner + "." + member.name);
        block.add(std::move(field));
      }
      break;
    case Kind::enumeration: {
      head("enumeration");
      const bool is_signed = std::string_view{to_string(type.primitive)}.starts_with("int");
      const bool shows =
          std::ranges::any_of(type.enumerators, [](const Enumerator& one) { return one.value < 0; });
      if (type.backing) {
        block.settings.push_back(fmt::format("EnumBackingType = {}", backing_name(*type.backing)));
      } else if (is_signed && !shows) {
        block.settings.push_back(fmt::format("EnumBackingType = {}", backing_name(type.primitive)));
      }
      set(block, "SomeIpEnumWidth", unsigned{messages::width(type.primitive)}, 1U);
      set(block, "SomeIpEnumBitWidth", static_cast<unsigned>(type.wire.bits), 0U);
      if (type.invalid_value) {
        block.settings.push_back(fmt::format("SomeIpEnumInvalidValue = {}", *type.invalid_value));
      }
      kept(block, type.notes, {}, owner);
      for (const Enumerator& one : type.enumerators) {
        Block child{.head = escaped_fdepl(plan_.member_name(index, one.name))};
        kept(child, one.notes, {"ErrorType"}, owner + "." + one.name);
        block.add(std::move(child));
      }
      break;
    }
    case Kind::map: {
      head("map");
      Block key{.head = "key"};
      Block value{.head = "value"};
      use(key, type.key, nullptr, User::map_part, owner);
      use(value, type.element, nullptr, User::map_part, owner);
      block.add(std::move(key));
      block.add(std::move(value));
      break;
    }
    case Kind::alias:
      if (type.element.wire != default_wire(resolved(model_, index).kind) &&
          is_basic(resolved(model_, index))) {
        lose(owner, "rules of a typedef; its uses have them", type.place);
      }
      break;
    case Kind::primitive:
    case Kind::string:
    case Kind::bytes:
      break;
  }
  return block;
}

void Deployment::types(Block& block, const Container& container) {
  for (const TypeIndex index : container.types) {
    block.add(type(index));
  }
}

void Deployment::rules(Block& block, const Payload& payload, const char* stem, const std::string& owner) {
  if (!payload.known) {
    lose(owner, "that its payload is not known: it is written as empty");
  }
  if (payload.byte_order == std::endian::little) {
    block.settings.push_back(fmt::format("SomeIp{}Endianess = le", stem));
    if (payload.length_fields_always_big && has_length_fields(model_, payload)) {
      lose(owner, "length fields in big endian beside data in little endian");
    }
  }
  if (payload.crc_bytes != 0) {
    block.settings.push_back(
        fmt::format("SomeIp{}CRCWidth = {}", stem, payload.crc_bytes == 1 ? "one" : "four"));
  }
  if (payload.alignment > 1) {
    lose(owner, "alignment");
  }
}

void Deployment::transfer(Block& block, const Transfer& transfer, const std::string& segment,
                          const std::string& separation, const std::string& debounce,
                          const std::string& retention, int retention_ms, const std::string& owner) {
  const auto time = [&](const std::string& key, std::chrono::microseconds now, int before) {
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(now);
    if (ms != now) {
      lose(owner,
           fmt::format("{} µs of {}, which is written in ms", now.count(), key.empty() ? "a time" : key));
    }
    if (ms.count() != before) {
      if (key.empty()) {
        lose(owner, "a time that FDEPL has no key for");
      } else {
        block.settings.push_back(fmt::format("{} = {}", key, ms.count()));
      }
    }
  };
  if (transfer.segment_bytes != 0) {
    if (segment.empty()) {
      lose(owner, "a segment length that FDEPL has no key for");
    } else {
      const std::uint32_t bytes = std::max(transfer.segment_bytes / 16 * 16, std::uint32_t{16});
      if (bytes != transfer.segment_bytes) {
        lose(owner, fmt::format("segments of {} bytes: a multiple of 16 is written, {}",
                                transfer.segment_bytes, bytes));
      }
      block.settings.push_back(fmt::format("{} = {}", segment, bytes));
    }
  }
  time(separation, transfer.separation, 0);
  time(debounce, transfer.debounce, 0);
  time(retention, transfer.retention, retention_ms);
}

Block Deployment::attribute(const Service& service, const Field& field) {
  Block block{.head = "attribute " + escaped_fdepl(plan_.attribute_name(service, field.name))};
  const std::string owner = member(field.name, field.place);
  const auto id = [&](const char* key, const std::optional<someip::MethodId>& number, bool there) {
    if (number) {
      block.settings.push_back(id_setting(key, *number, service.chosen_ids.contains(*number)));
    } else if (there) {
      lose(owner, fmt::format("it has no {} yet", key));
    }
  };
  id("SomeIpGetterID", field.getter, field.has_getter);
  id("SomeIpSetterID", field.setter, field.has_setter);
  id("SomeIpNotifierID", field.notifier, field.has_notifier);
  if (!field.eventgroups.empty()) {
    block.settings.push_back("SomeIpNotifierEventGroups = " + listed(field.eventgroups));
  }
  const bool reliable = field.notifier_transfer.transport == Transport::tcp;
  if (reliable) {
    block.settings.emplace_back("SomeIpAttributeReliable = true");
  }
  if ((field.getter_transfer.transport == Transport::tcp) != reliable ||
      (field.setter_transfer.transport == Transport::tcp) != reliable) {
    lose(owner, "getter, setter and notifier by different transports");
  }
  transfer(block, field.getter_transfer, "SomeIpGetterSegmentLengthResponse",
           "SomeIpGetterSeparationTimeResponse", "SomeIpGetterRequestDebounceTime",
           "SomeIpGetterMaxRetentionTime", 5, owner);
  transfer(block, field.setter_transfer, "SomeIpSetterSegmentLength", "SomeIpSetterSeparationTime",
           "SomeIpSetterRequestDebounceTime", "SomeIpSetterMaxRetentionTime", 5, owner);
  transfer(block, field.notifier_transfer, "SomeIpNotifierSegmentLength", "SomeIpNotifierSeparationTime",
           "SomeIpNotifierDebounceTime", "SomeIpNotifierMaxRetentionTime", 5, owner);
  rules(block, field.payload, "Attribute", owner);
  kept(block, field.notes,
       {"AttributeSetterTimeout", "AttributeGetterTimeout", "AttributeNotifierTimeout",
        "AttributeNotifierUpdateMode", "SomeIpGetterResponseMaxRetentionTime",
        "SomeIpSetterResponseMaxRetentionTime", "SomeIpGetterResponseDebounceTime",
        "SomeIpSetterResponseDebounceTime"},
       owner);
  if (!field.payload.values.empty()) {
    use(block, field.payload.values.front(), nullptr, User::attribute, owner);
  }
  if (field.cycle) {
    lose(owner, "a cycle");
  }
  if (!field.e2e.empty() || !field.getter_e2e.empty() || !field.setter_e2e.empty()) {
    lose(owner, "E2E protection");
  }
  return block;
}

void Deployment::arguments(Block& block, const char* head, const Payload& payload,
                           const std::vector<std::string>& names, const std::string& owner) {
  Block all{.head = head};
  for (std::size_t at = 0; at < names.size(); ++at) {
    const Value& value = payload.values[at];
    Block argument{.head = escaped_fdepl(names[at])};
    use(argument, value, nullptr, User::argument, owner + "." + value.name);
    all.add(std::move(argument));
  }
  block.add(std::move(all));
}

Block Deployment::method(const Service& service, const Method& method) {
  Block block{.head =
                  "method " + escaped_fdepl(plan_.method_name(service, method)) + selector(method.selector)};
  const std::string owner = member(member_key(method.name, method.selector), method.place);
  if (method.id) {
    block.settings.push_back(
        id_setting("SomeIpMethodID", *method.id, service.chosen_ids.contains(*method.id)));
  } else {
    lose(owner, "it has no SomeIpMethodID yet");
  }
  const bool reliable = method.request_transfer.transport == Transport::tcp;
  if (reliable) {
    block.settings.emplace_back("SomeIpReliable = true");
  }
  if (!method.fire_and_forget && (method.response_transfer.transport == Transport::tcp) != reliable) {
    lose(owner, "request and response by different transports");
  }
  transfer(block, method.request_transfer, "SomeIpMethodSegmentLength", "SomeIpMethodSeparationTime",
           "SomeIpMethodRequestDebounceTime", "SomeIpMethodMaxRetentionTime", 5, owner);
  transfer(block, method.response_transfer, "SomeIpMethodSegmentLengthResponse",
           "SomeIpMethodSeparationTimeResponse", "SomeIpMethodResponseDebounceTime",
           "SomeIpMethodResponseMaxRetentionTime", 0, owner);
  rules(block, method.request, "Method", owner);
  if (method.request.known && !method.response.known && !method.fire_and_forget) {
    lose(owner, "that the payload of its response is not known: it is written as empty");
  }
  if (method.request.alignment == 1 && method.response.alignment > 1) {
    lose(owner, "alignment of its response");
  }
  if (method.response.byte_order != method.request.byte_order && !method.response.values.empty()) {
    lose(owner, "request and response in different byte orders");
  }
  if (method.timeout) {
    block.settings.push_back(fmt::format("MethodTimeout = {}", method.timeout->count()));
  }
  kept(block, method.notes, {"Errors"}, owner);
  const ArgumentNames names{method};
  arguments(block, "in", method.request, names.in, owner);
  if (!method.fire_and_forget) {
    arguments(block, "out", method.response, names.out, owner);
  }
  if (method.fire_and_forget && (!method.response.values.empty() || method.error != no_type)) {
    lose(owner, "what it answers, as it is called without waiting (fireAndForget)");
  }
  if (!method.application_errors.empty()) {
    lose(owner, "errors of an application");
  }
  if (!method.e2e.empty()) {
    lose(owner, "E2E protection");
  }
  return block;
}

Block Deployment::event(const Service& service, const Event& event) {
  Block block{.head = "broadcast " + escaped_fdepl(plan_.broadcast_name(service, event)) +
                      selector(event.selector)};
  const std::string owner = member(member_key(event.name, event.selector), event.place);
  if (event.id) {
    block.settings.push_back(id_setting("SomeIpEventID", *event.id, service.chosen_ids.contains(*event.id)));
  } else {
    lose(owner, "it has no SomeIpEventID yet");
  }
  if (!event.eventgroups.empty()) {
    block.settings.push_back("SomeIpEventGroups = " + listed(event.eventgroups));
  }
  if (event.transfer.transport == Transport::tcp) {
    block.settings.emplace_back("SomeIpReliable = true");
  }
  transfer(block, event.transfer, "SomeIpBroadcastSegmentLength", "SomeIpBroadcastSeparationTime",
           "SomeIpBroadcastDebounceTime", "SomeIpBroadcastMaxRetentionTime", 5, owner);
  rules(block, event.payload, "Broadcast", owner);
  kept(block, event.notes, {"BroadcastType", "ErrorName"}, owner);
  arguments(block, "out", event.payload, argument_names(event), owner);
  if (event.cycle) {
    lose(owner, "a cycle");
  }
  if (!event.e2e.empty()) {
    lose(owner, "E2E protection");
  }
  return block;
}

Block Deployment::interface(const Container& container) {
  const Service& service = *container.service;
  service_ = full_name(service.scope, service.name);
  place_ = service.place;
  Block block{.head = fmt::format("define org.genivi.commonapi.someip.deployment for interface {}",
                                  container.full())};
  if (service.id) {
    block.settings.push_back(id_setting("SomeIpServiceID", *service.id, service.id_is_chosen));
  } else {
    lose(service_, "it has no SomeIpServiceID yet");
  }
  if (!service.eventgroups.empty()) {
    std::vector<someip::EventgroupId> groups;
    for (const Eventgroup& group : service.eventgroups) {
      groups.push_back(group.id);
      // allocate_ids() calls a group "all" that stands nowhere.
      const bool is_made = group.name == "all" && group.place.mark.line == 0;
      if (!group.name.empty() && !is_made) {
        lose(service_, fmt::format("the name '{}' of an eventgroup", group.name), group.place);
      }
    }
    std::string setting = "SomeIpEventGroups = " + listed(groups);
    std::erase_if(groups, [&](someip::EventgroupId id) {
      return !std::ranges::find(service.eventgroups, id, &Eventgroup::id)->id_is_chosen;
    });
    if (!groups.empty()) {
      setting += fmt::format("  // {}: {}", listed(groups), chosen_id_note);
    }
    block.settings.push_back(std::move(setting));
  }
  if (!service.namespaces.empty()) {
    lose(service_, "namespaces");
  }
  kept(block, service.notes, {"DefaultTimeout"}, service_);
  const Inherited inherited{plan_.service(service.base)};
  if (const Container* const base = plan_.service(service.base);
      base != nullptr && base->service != nullptr) {
    lose_what_differs(service, *base->service);
  }
  for (const Field& field : service.fields) {
    if (!inherited.fields.contains(field.name) && plan_.is_written(field)) {
      block.children.push_back(attribute(service, field));
    }
  }
  for (const Method& one : service.methods) {
    if (!inherited.methods.contains(member_key(one.name, one.selector))) {
      block.children.push_back(method(service, one));
    }
  }
  for (const Event& one : service.events) {
    if (!inherited.events.contains(member_key(one.name, one.selector))) {
      block.children.push_back(event(service, one));
    }
  }
  types(block, container);
  return block;
}

namespace {

/// The settings in a block, each on a line of its own.
std::set<std::string> settings_of(const Block& block) {
  std::set<std::string> all{block.settings.begin(), block.settings.end()};
  for (const Block& child : block.children) {
    all.merge(settings_of(child));
  }
  return all;
}

bool has_same_protection(const Field& one, const Field& other) {
  return one.e2e == other.e2e && one.getter_e2e == other.getter_e2e && one.setter_e2e == other.setter_e2e;
}
bool has_same_protection(const auto& one, const auto& other) {
  return one.e2e == other.e2e;
}

}  // namespace

/// FDEPL says what an interface inherits where it is declared, and nowhere else.
void Deployment::lose_what_differs(const Service& service, const Service& base) {
  const auto key_of = [](const auto& one) {
    if constexpr (requires { one.selector; }) {
      return member_key(one.name, one.selector);
    } else {
      return one.name;
    }
  };
  // Gives the one the ids of the other.
  const auto take_ids = [](auto& one, const auto& other) {
    if constexpr (requires { one.getter; }) {
      const bool differ =
          one.getter != other.getter || one.setter != other.setter || one.notifier != other.notifier;
      one.getter = other.getter;
      one.setter = other.setter;
      one.notifier = other.notifier;
      return differ;
    } else {
      return std::exchange(one.id, other.id) != other.id;
    }
  };
  // What both lose is told where the member is declared.
  std::vector<NotCarried> untold;
  Deployment both{model_, plan_, untold};
  both.overwrites_ = overwrites_;
  const auto compare = [&](const auto& own, const auto& inherited, const auto& block_of) {
    std::map<std::string, const std::remove_cvref_t<decltype(own.front())>*, std::less<>> of_base;
    for (const auto& one : inherited) {
      of_base.emplace(key_of(one), &one);
    }
    for (const auto& one : own) {
      const auto found = of_base.find(key_of(one));
      if (found == of_base.end()) {
        continue;
      }
      const auto& other = *found->second;
      const auto tell = [&](const char* what, const std::string& which = {}) {
        lose(service_ + "." + key_of(one),
             fmt::format("{} than in the interface that it is inherited from{}{}", what,
                         which.empty() ? "" : ": ", which),
             one.place);
      };
      auto alike = one;
      if (take_ids(alike, other)) {
        tell("other ids");
      }
      const std::set<std::string> now = settings_of(block_of(alike));
      const std::set<std::string> before = settings_of(block_of(other));
      untold.clear();
      if (now != before) {
        std::vector<std::string> only;
        std::ranges::set_difference(now, before, std::back_inserter(only));
        constexpr std::size_t most = 5;
        only.resize(std::min(only.size(), most));
        tell("other settings", fmt::to_string(fmt::join(only, ", ")));
      }
      if (!has_same_protection(one, other)) {
        tell("another E2E protection");
      }
      if constexpr (requires { one.cycle; }) {
        if (one.cycle != other.cycle) {
          tell("another cycle");
        }
      }
    }
  };
  compare(service.methods, base.methods, [&](const Method& one) { return both.method(base, one); });
  compare(service.events, base.events, [&](const Event& one) { return both.event(base, one); });
  compare(service.fields, base.fields, [&](const Field& one) { return both.attribute(base, one); });
  overwrites_ = both.overwrites_;
}

Block Deployment::collection(const Container& container) {
  Block block{.head =
                  fmt::format("define org.genivi.commonapi.someip.deployment for typeCollection {0} as {0}",
                              container.full())};
  types(block, container);
  return block;
}

Block Deployment::provider(const Instance& instance, const std::string& name) {
  Block block{.head = "define org.genivi.commonapi.someip.deployment for provider as " + name};
  Block inner{.head = "instance " + plan_.service_name(instance.service)};
  place_ = instance.place;
  inner.settings.push_back("InstanceId = " + quoted(instance.name.empty() ? name : instance.name));
  if (instance.name.empty()) {
    lose(instance.service, fmt::format("an instance without a name, which gets the InstanceId '{}'", name),
         instance.place);
  }
  if (instance.id) {
    inner.settings.push_back(id_setting("SomeIpInstanceID", *instance.id, instance.id_is_chosen));
  } else {
    lose(label_of(instance), "it has no SomeIpInstanceID yet", instance.place);
  }
  if (instance.address) {
    inner.settings.push_back("SomeIpUnicastAddress = " + quoted(full_text(*instance.address)));
  }
  if (instance.tcp_port) {
    inner.settings.push_back(fmt::format("SomeIpReliableUnicastPort = {}", *instance.tcp_port));
  }
  if (instance.udp_port) {
    inner.settings.push_back(fmt::format("SomeIpUnreliableUnicastPort = {}", *instance.udp_port));
  }
  if (!instance.multicast.empty()) {
    std::vector<someip::EventgroupId> groups;
    std::vector<std::uint16_t> ports;
    std::vector<std::uint32_t> thresholds;
    std::string addresses;
    for (const Multicast& one : instance.multicast) {
      groups.push_back(one.eventgroup);
      ports.push_back(one.group.port);
      thresholds.push_back(one.threshold);
      addresses += (addresses.empty() ? "" : ", ") + quoted(full_text(one.group.address));
    }
    inner.settings.push_back("SomeIpMulticastEventGroups = " + listed(groups));
    inner.settings.push_back("SomeIpMulticastAddresses = { " + addresses + " }");
    inner.settings.push_back("SomeIpMulticastPorts = " + listed(ports));
    inner.settings.push_back("SomeIpMulticastThreshold = " + listed(thresholds));
  }
  kept(inner, instance.notes, {"Domain", "Variant", "Year", "PreregisteredProperties"}, label_of(instance));
  if (instance.timing || instance.priority || instance.weight || !instance.configuration.empty() ||
      !instance.machine.empty()) {
    lose(label_of(instance), "settings of service discovery, or the machine", instance.place);
  }
  if (instance.major || instance.minor) {
    lose(label_of(instance), "a version of the instance's own", instance.place);
  }
  block.children.push_back(std::move(inner));
  return block;
}

}  // namespace trestle::describe::fidl_writing
