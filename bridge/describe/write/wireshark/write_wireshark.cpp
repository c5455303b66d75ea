#include "bridge/describe/write/wireshark/write_wireshark.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "bridge/describe/eventgroup_title.hpp"
#include "bridge/describe/layout.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/describe/protection.hpp"

namespace trestle::describe {
namespace {

using someip::FieldWidth;

/// Numbers of Wireshark's kinds of types.
enum class Table : std::uint8_t { base = 1, string, array, structure, choice, alias, enumeration };

/// A type in Wireshark's tables.
struct Reference {
  Table table{};
  unsigned id = 0;
};

/// What types inherit from their payload and from what holds them.
struct Context {
  std::endian byte_order = std::endian::big;
  FieldWidth tagged_length = FieldWidth::bits32;
  bool is_tagged = false;  ///< the length field is that of tagged members
};

constexpr const char* too_deep = "types nested too deep";
/// Wireshark reads types again and again; deeper ones no network has.
constexpr int max_depth = 64;
/// Elements of an array that has no limit; Wireshark shows larger numbers as negative ones.
constexpr unsigned no_limit = 0x7fff'ffff;

unsigned bits(FieldWidth width) {
  return static_cast<unsigned>(someip::bytes(width)) * 8;
}

/// For a cell of a table. Control characters, quotes and backslashes mean something to Wireshark.
std::string cell(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += static_cast<unsigned char>(c) < 0x20 || c == '"' || c == '\\' || c == '\x7f' ? '_' : c;
  }
  return out;
}

/// For a filter: letters, digits, '_', and no '.' at the ends.
std::string filter_part(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    out += is_plain ? c : '_';
  }
  return out.empty() ? "_" : out;
}

/// A row of a table.
struct WiresharkRow {
  std::string table;
  std::string line;
};

const char* truth(bool value) {
  return value ? "TRUE" : "FALSE";
}

/// How many bytes the E2E header in front of a payload has; nothing: it stands elsewhere.
std::optional<unsigned> e2e_bytes(const Protection& e2e) {
  const std::optional<ProtectionHeader> header = protection_header(e2e);
  return header && header->at == 0 ? std::optional{static_cast<unsigned>(header->bytes)} : std::nullopt;
}

class WiresharkWriter {
 public:
  explicit WiresharkWriter(const Model& model) : model_{model}, labels_{type_labels(model)} {}

  Written write();

 private:
  void service(const Service& service);
  void payload(const std::string& element, someip::MethodId id, unsigned message_type, const Payload& payload,
               const Protection& e2e, TypeIndex error, Place place);
  /// It stays whatever becomes of the payload.
  void name(const Service& service, someip::MethodId id, const std::string& name);
  [[nodiscard]] std::vector<Value> values_of(const Payload& payload, TypeIndex error) const;
  void preferences();

  /// The type of a use. Nothing, where it has no bytes at all; `why_not_` is set where Wireshark has no form.
  std::optional<Reference> use(TypeIndex type, Wire wire, Context context, int depth);
  std::optional<Reference> new_use(TypeIndex type, const Wire& wire, const Context& context, int depth,
                                   const std::string& key);
  std::optional<Reference> primitive(messages::Primitive primitive, const Type& type, const Wire& wire,
                                     const Context& context);
  std::optional<Reference> string(const Type& type, const Wire& wire, const Context& context);
  std::optional<Reference> array(const Type& type, const Wire& wire, const Context& context, int depth,
                                 const std::string& key);
  std::optional<Reference> array_of(Reference element, const std::string& name, unsigned min, unsigned max,
                                    FieldWidth length, unsigned id);
  std::optional<Reference> structure(const Type& type, const Wire& wire, const Context& context, int depth,
                                     const std::string& key);
  std::optional<Reference> choice(const Type& type, const Wire& wire, const Context& context, int depth,
                                  const std::string& key);
  std::optional<Reference> enumeration(const Type& type, const Wire& wire, const Context& context);
  std::optional<Reference> cannot(std::string why) {
    if (why_not_.empty()) {
      why_not_ = std::move(why);
    }
    return std::nullopt;
  }
  unsigned new_id(Table table) { return ++last_ids_[static_cast<std::size_t>(table)]; }
  Reference remember(const std::string& key, Table table) {
    const Reference reference{table, new_id(table)};
    known_.insert_or_assign(key, reference);
    fresh_.push_back(key);
    return reference;
  }
  /// That of an eventgroup; without one, what is in it.
  static std::string name_of(const Service& service, someip::EventgroupId id) {
    const std::string title = title_of(&service, id).text;
    return title.empty() ? fmt::format("eventgroup_{:04x}", someip::value(id)) : cell(title);
  }
  [[nodiscard]] std::string name_of(const Type& type) const {
    return type.name.empty() ? to_string(type.kind) : cell(type.name);
  }
  template <typename... Cells>
  void row(const char* table, const Cells&... cells) {
    std::string line;
    ((line += fmt::format("{}\"{}\"", line.empty() ? "" : ",", cells)), ...);
    pending_.push_back({table, line + "\n"});
  }
  /// A row that gives an id a name.
  template <typename... Cells>
  void name_row(bool id_is_chosen, const char* table, const Cells&... cells) {
    if (id_is_chosen) {
      pending_.push_back({table, fmt::format("# {}:\n", chosen_id_note)});
    }
    row(table, cells...);
  }
  /// The rows of a payload count only when all of it has a form.
  void commit() {
    for (WiresharkRow& one : pending_) {
      tables_[one.table] += one.line;
    }
    pending_.clear();
    fresh_.clear();
  }
  void roll_back() {
    for (const std::string& key : fresh_) {
      known_.erase(key);
    }
    pending_.clear();
    fresh_.clear();
    open_.clear();
  }
  void lost(std::string element, std::string what, Place place) {
    written_.not_carried.push_back({std::move(element), std::move(what), place});
  }

  const Model& model_;
  std::vector<std::string> labels_;
  std::map<std::string, std::string> tables_;
  std::vector<WiresharkRow> pending_;
  std::vector<std::string> fresh_;  ///< what is known since the last payload
  /// The structures that are being written, since the last array or choice: if one of them comes again, it
  /// has no end.
  std::vector<std::string> open_;
  std::map<std::string, Reference> known_;     ///< by all that its rows depend on
  std::set<std::string> without_bytes_;        ///< by the same
  std::map<std::string, std::string> failed_;  ///< by the same: why
  std::array<unsigned, 8> last_ids_{};
  std::string why_not_;
  Written written_;
  std::set<someip::ServiceId> services_;
  std::string service_id_;
  std::string service_name_;
  unsigned major_ = 1;
};

std::optional<Reference> WiresharkWriter::use(TypeIndex index, Wire wire, Context context, int depth) {
  if (static_cast<std::size_t>(index) >= model_.types.size()) {
    return cannot("a type that is not known");
  }
  if (depth > max_depth) {
    return cannot(too_deep);
  }
  const Type& type = model_.at(index);
  context.byte_order = wire.byte_order.value_or(context.byte_order);
  if (context.is_tagged) {
    wire.length = context.tagged_length;
  }
  const std::string key =
      fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {}", static_cast<unsigned>(index), bits(wire.length),
                  bits(wire.selector), wire.length_first, static_cast<int>(wire.encoding), wire.bom,
                  wire.terminator, wire.fixed_bytes, wire.bits, context.byte_order == std::endian::big,
                  bits(context.tagged_length), static_cast<int>(type.kind), context.is_tagged);
  context.is_tagged = false;
  if (const auto found = known_.find(key); found != known_.end()) {
    return std::ranges::find(open_, key) == open_.end() ? std::optional{found->second}
                                                        : cannot("a structure that contains itself");
  }
  if (without_bytes_.contains(key)) {
    return std::nullopt;
  }
  if (const auto failed = failed_.find(key); failed != failed_.end()) {
    return cannot(failed->second);
  }
  auto made = new_use(index, wire, context, depth, key);
  if (!made && why_not_.empty()) {
    without_bytes_.insert(key);
  } else if (!made && why_not_ != too_deep) {  // from nearer it may not be
    failed_.emplace(key, why_not_);
  }
  return made;
}

std::optional<Reference> WiresharkWriter::new_use(TypeIndex index, const Wire& wire, const Context& context,
                                                  int depth, const std::string& key) {
  const Type& type = model_.at(index);
  switch (type.kind) {
    case Kind::primitive:
      return primitive(type.primitive, type, wire, context);
    case Kind::string:
      return string(type, wire, context);
    case Kind::bytes:
    case Kind::array:
    case Kind::map:
      return array(type, wire, context, depth, key);
    case Kind::structure:
      return structure(type, wire, context, depth, key);
    case Kind::choice:
      return choice(type, wire, context, depth, key);
    case Kind::enumeration:
      return enumeration(type, wire, context);
    case Kind::alias: {
      const auto target = use(type.element.type, wire, context, depth + 1);
      if (!target || type.name.empty()) {
        return target;
      }
      const Reference reference = remember(key, Table::alias);
      row("SOMEIP_parameter_typedefs", fmt::format("{:x}", reference.id), name_of(type),
          static_cast<unsigned>(target->table), fmt::format("{:x}", target->id));
      return reference;
    }
  }
  return cannot("a kind of type that is not known");
}

std::optional<Reference> WiresharkWriter::primitive(messages::Primitive primitive, const Type& type,
                                                    const Wire& wire, const Context& context) {
  if (wire.bits != 0 && wire.bits != messages::width(primitive) * 8) {
    return cannot("bit fields");
  }
  using messages::Primitive;
  const bool is_signed = primitive == Primitive::int8 || primitive == Primitive::int16 ||
                         primitive == Primitive::int32 || primitive == Primitive::int64;
  const bool is_float = primitive == Primitive::float32 || primitive == Primitive::float64;
  const unsigned width = messages::width(primitive) * 8U;
  if (width == 0) {
    return cannot("a string as a number");
  }
  // Wireshark knows "float32"; of "float" it shows nothing, and says nothing.
  const std::string datatype = fmt::format("{}{}", is_float ? "float" : is_signed ? "int" : "uint", width);
  const bool is_big = context.byte_order == std::endian::big || width == 8;
  const std::string name = primitive == Primitive::boolean ? "boolean" : datatype;
  const std::string key = fmt::format("base {} {}", name, is_big);
  auto found = known_.find(key);
  if (found == known_.end()) {
    remember(key, Table::base);
    found = known_.find(key);
    row("SOMEIP_parameter_base_types", fmt::format("{:x}", found->second.id), name + (is_big ? "" : "_le"),
        datatype, truth(is_big), width, width);
  }
  const Reference base = found->second;
  if (type.kind != Kind::primitive || type.name.empty()) {
    return base;
  }
  const std::string named = fmt::format("named {} {}", full_name(type.scope, type.name), base.id);
  if (const auto alias = known_.find(named); alias != known_.end()) {
    return alias->second;
  }
  const Reference alias = remember(named, Table::alias);
  row("SOMEIP_parameter_typedefs", fmt::format("{:x}", alias.id), name_of(type),
      static_cast<unsigned>(base.table), fmt::format("{:x}", base.id));
  return alias;
}

std::optional<Reference> WiresharkWriter::string(const Type& type, const Wire& wire, const Context&) {
  const bool is_fixed = wire.length == FieldWidth::none;
  if (is_fixed && wire.fixed_bytes == 0) {
    return cannot("a string without length field that ends by its terminator");
  }
  const bool is_utf8 = wire.encoding == someip::StringEncoding::utf8;
  const bool is_big = wire.encoding != someip::StringEncoding::utf16le;
  const std::string key = fmt::format("string {} {} {} {} {}", full_name(type.scope, type.name),
                                      bits(wire.length), is_fixed ? wire.fixed_bytes : 0, is_utf8, is_big);
  if (const auto found = known_.find(key); found != known_.end()) {
    return found->second;
  }
  const Reference reference = remember(key, Table::string);
  row("SOMEIP_parameter_strings", fmt::format("{:x}", reference.id), name_of(type),
      is_utf8 ? "utf-8" : "utf-16", truth(!is_fixed), is_fixed ? wire.fixed_bytes : 0U, bits(wire.length),
      truth(is_big), 0);
  return reference;
}

std::optional<Reference> WiresharkWriter::array_of(Reference element, const std::string& name, unsigned min,
                                                   unsigned max, FieldWidth length, unsigned id) {
  row("SOMEIP_parameter_arrays", fmt::format("{:x}", id), name, static_cast<unsigned>(element.table),
      fmt::format("{:x}", element.id), 1, fmt::format("{}.array_{}", service_name_, id), 0, min, max,
      bits(length), 0);
  return Reference{Table::array, id};
}

std::optional<Reference> WiresharkWriter::array(const Type& type, const Wire& wire, const Context& context,
                                                int depth, const std::string& key) {
  if (wire.length == FieldWidth::none && (!type.fixed_size || type.max_size == 0)) {
    return type.fixed_size ? std::nullopt : cannot("an array of variable size without length field");
  }
  const Reference reference = remember(key, Table::array);
  std::vector<std::string> outside;
  if (!type.fixed_size) {
    outside.swap(open_);
  }
  std::optional<Reference> element;
  if (type.kind == Kind::bytes) {
    element = primitive(messages::Primitive::uint8, Type{}, {}, context);
  } else if (type.kind == Kind::map) {
    Type pair{.kind = Kind::structure, .name = name_of(type) + "_entry", .members = {type.key, type.element}};
    pair.members[0].name = "key";
    pair.members[1].name = "value";
    element = structure(pair, {}, context, depth + 1, key + " entry");
  } else {
    element = use(type.element.type, type.element.wire, context, depth + 1);
  }
  if (!type.fixed_size) {
    open_.swap(outside);
  }
  if (!element) {
    return cannot("an array of elements without bytes");
  }
  const unsigned max = type.max_size == 0 ? no_limit : type.max_size;
  // It is what each element is called.
  const std::string name = type.name.empty() ? "element" : name_of(type);
  return array_of(*element, name, type.fixed_size ? max : type.min_size, max, wire.length, reference.id);
}

std::optional<Reference> WiresharkWriter::structure(const Type& type, const Wire& wire,
                                                    const Context& context, int depth,
                                                    const std::string& key) {
  if (is_polymorphic(model_, type)) {
    return cannot("a polymorphic structure");
  }
  const std::vector<Value> members = all_members(model_, type);
  const Reference reference = remember(key, Table::structure);
  const bool is_tagged =
      !members.empty() && std::ranges::all_of(members, [](const Value& one) { return one.tag.has_value(); });
  if (!is_tagged && std::ranges::any_of(members, [](const Value& one) { return one.tag.has_value(); })) {
    return cannot("members with and without tags in one structure");
  }
  struct MemberRow {
    unsigned position;
    std::string name;
    Reference type;
  };
  std::vector<MemberRow> rows;
  open_.push_back(key);
  for (const Value& member : members) {
    Context inner = context;
    inner.is_tagged = is_tagged;
    if (const auto type_of = use(member.type, member.wire, inner, depth + 1)) {
      const auto position =
          is_tagged ? static_cast<unsigned>(*member.tag) : static_cast<unsigned>(rows.size());
      rows.push_back({position, member.name, *type_of});
    } else if (!why_not_.empty()) {
      return std::nullopt;
    }
  }
  open_.pop_back();
  if (rows.empty()) {
    known_.erase(key);
    if (wire.length == FieldWidth::none) {
      return std::nullopt;
    }
    // Wireshark has no structure without members. Its length field, and what newer senders have in it, are
    // bytes.
    const auto byte = primitive(messages::Primitive::uint8, Type{}, {}, context);
    const Reference bytes = remember(key, Table::array);
    return array_of(*byte, name_of(type), 0, no_limit, wire.length, bytes.id);
  }
  unsigned count = static_cast<unsigned>(rows.size());
  if (is_tagged) {
    for (const MemberRow& one : rows) {
      count = std::max(count, one.position + 1);
    }
  }
  for (const MemberRow& one : rows) {
    row("SOMEIP_parameter_structs", fmt::format("{:x}", reference.id), name_of(type), bits(wire.length), 0,
        truth(is_tagged), count, one.position, cell(one.name), static_cast<unsigned>(one.type.table),
        fmt::format("{:x}", one.type.id),
        fmt::format("{}.{}_{}.{}", service_name_, filter_part(name_of(type)), reference.id,
                    filter_part(one.name)));
  }
  return reference;
}

std::optional<Reference> WiresharkWriter::choice(const Type& type, const Wire& wire, const Context& context,
                                                 int depth, const std::string& key) {
  if (!wire.length_first && wire.length != FieldWidth::none) {
    return cannot("a choice whose selector comes before its length field");
  }
  if (wire.length == FieldWidth::none && wire.fixed_bytes != 0) {
    return cannot("a choice that is filled up to a fixed size");
  }
  const Reference reference = remember(key, Table::choice);
  const std::vector<Value> members = all_members(model_, type);
  struct MemberRow {
    std::uint32_t selector;
    std::string name;
    Reference type;
  };
  std::vector<MemberRow> rows;
  std::vector<std::string> outside;
  outside.swap(open_);
  for (std::size_t at = 0; at < members.size(); ++at) {
    if (const auto type_of = use(members[at].type, members[at].wire, context, depth + 1)) {
      rows.push_back({at < type.selectors.size() ? type.selectors[at] : static_cast<std::uint32_t>(at + 1),
                      members[at].name, *type_of});
    } else if (!why_not_.empty()) {
      return std::nullopt;
    }
  }
  open_.swap(outside);
  if (rows.empty()) {
    return cannot("a choice without members");
  }
  for (const MemberRow& one : rows) {
    row("SOMEIP_parameter_unions", fmt::format("{:x}", reference.id), name_of(type), bits(wire.length),
        bits(wire.selector), 0, rows.size(), one.selector, cell(one.name),
        static_cast<unsigned>(one.type.table), fmt::format("{:x}", one.type.id),
        fmt::format("{}.{}_{}.{}", service_name_, filter_part(name_of(type)), reference.id,
                    filter_part(one.name)));
  }
  return reference;
}

messages::Primitive unsigned_of(messages::Primitive primitive) {
  switch (messages::width(primitive)) {
    case 2:
      return messages::Primitive::uint16;
    case 4:
      return messages::Primitive::uint32;
    case 8:
      return messages::Primitive::uint64;
    default:
      return messages::Primitive::uint8;
  }
}

std::optional<Reference> WiresharkWriter::enumeration(const Type& type, const Wire& wire,
                                                      const Context& context) {
  // Wireshark finds no names for values of signed types.
  const auto base = primitive(unsigned_of(type.primitive), type, wire, context);
  if (!base) {
    return base;
  }
  const std::string key = fmt::format("enumeration {} {}", static_cast<const void*>(&type), base->id);
  if (const auto found = known_.find(key); found != known_.end()) {
    return found->second;
  }
  const std::vector<Enumerator> enumerators = all_enumerators(model_, type);
  if (enumerators.empty()) {
    return base;
  }
  const Reference reference = remember(key, Table::enumeration);
  const unsigned width = messages::width(type.primitive) * 8U;
  const std::uint64_t mask = width >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << width) - 1;
  std::set<std::uint64_t> values;  // two names of one value: Wireshark shows the first
  std::vector<std::pair<std::uint64_t, std::string>> rows;
  for (const Enumerator& one : enumerators) {
    const std::uint64_t value = static_cast<std::uint64_t>(one.value) & mask;
    if (values.insert(value).second) {
      rows.emplace_back(value, cell(one.name));
    }
  }
  for (const auto& [value, name] : rows) {
    row("SOMEIP_parameter_enums", fmt::format("{:x}", reference.id), name_of(type),
        static_cast<unsigned>(base->table), fmt::format("{:x}", base->id), rows.size(),
        fmt::format("{:x}", value), name);
  }
  return reference;
}

std::vector<Value> WiresharkWriter::values_of(const Payload& payload, TypeIndex error) const {
  std::vector<Value> values = payload.values;
  if (error != no_type) {
    values.insert(values.begin(), Value{.name = "error", .type = error, .wire = model_.at(error).wire});
  }
  return values;
}

void WiresharkWriter::payload(const std::string& element, someip::MethodId id, unsigned message_type,
                              const Payload& payload, const Protection& e2e, TypeIndex error, Place place) {
  std::string why;
  const std::vector<Value> values = values_of(payload, error);
  Payload whole = payload;
  whole.values = values;
  if (!payload.known) {
    why = "what it carries: that is not known";
  } else if (payload.byte_order == std::endian::little && !payload.length_fields_always_big &&
             has_length_fields(model_, whole)) {
    why = "little endian length fields";
  } else if (payload.alignment > 1) {
    why = "alignment";
  } else if (payload.crc_bytes != 0) {
    why = "a CRC in the payload";
  } else if (!e2e_bytes(e2e)) {
    why = no_header_text(e2e);
  }
  const bool is_tagged =
      !values.empty() && std::ranges::all_of(values, [](const Value& one) { return one.tag.has_value(); });
  struct MemberRow {
    unsigned position;
    std::string name;
    Reference type;
  };
  std::vector<MemberRow> rows;
  const Context context{
      .byte_order = payload.byte_order, .tagged_length = payload.tagged_length, .is_tagged = is_tagged};
  if (why.empty() && !e2e.profile.empty()) {
    if (is_tagged) {
      why = "an E2E header before tagged members";
    } else {
      const auto byte = primitive(messages::Primitive::uint8, Type{}, {}, {});
      const unsigned size = *e2e_bytes(e2e);
      rows.push_back({0, "e2e_header",
                      *array_of(*byte, "E2E header", size, size, FieldWidth::none, new_id(Table::array))});
    }
  }
  for (const Value& value : values) {
    if (!why.empty()) {
      break;
    }
    why_not_.clear();
    if (const auto type = use(value.type, value.wire, context, 0)) {
      const auto position =
          is_tagged ? static_cast<unsigned>(*value.tag) : static_cast<unsigned>(rows.size());
      rows.push_back({position, value.name, *type});
    }
    why = why_not_;
  }
  if (!why.empty()) {
    roll_back();
    lost(element, why, place);
    return;
  }
  unsigned count = static_cast<unsigned>(rows.size());
  for (const MemberRow& one : rows) {
    count = is_tagged ? std::max(count, one.position + 1) : count;
  }
  for (const MemberRow& one : rows) {
    row("SOMEIP_parameter_list", service_id_, fmt::format("{:04x}", someip::value(id)), major_,
        fmt::format("{:02x}", message_type), truth(is_tagged), count, one.position, cell(one.name),
        static_cast<unsigned>(one.type.table), fmt::format("{:x}", one.type.id),
        fmt::format("{}.m{:04x}_{:02x}.{}", service_name_, someip::value(id), message_type,
                    filter_part(one.name)));
  }
  commit();
}

void WiresharkWriter::name(const Service& service, someip::MethodId id, const std::string& name) {
  name_row(service.chosen_ids.contains(id), "SOMEIP_method_event_identifiers", service_id_,
           fmt::format("{:04x}", someip::value(id)), cell(name));
  commit();
}

void WiresharkWriter::service(const Service& service) {
  const std::string full = full_name(service.scope, service.name);
  if (!service.id) {
    lost(full, "a service without id", service.place);
    return;
  }
  if (!services_.insert(*service.id).second) {
    lost(full, "a second service of one id", service.place);
    return;
  }
  constexpr unsigned request = 0x00;
  constexpr unsigned request_no_return = 0x01;
  constexpr unsigned notification = 0x02;
  constexpr unsigned response = 0x80;
  service_id_ = fmt::format("{:04x}", someip::value(*service.id));
  service_name_ = filter_part(service.name);
  major_ = service.major;
  name_row(service.id_is_chosen, "SOMEIP_service_identifiers", service_id_, cell(service.name));
  std::set<someip::MethodId> ids;
  const auto is_new = [&](const std::string& element, const std::optional<someip::MethodId>& id,
                          Place place) {
    if (!id) {
      lost(full + "." + element, "no id", place);
    } else if (!ids.insert(*id).second) {
      lost(full + "." + element, "a second element of one id", place);
      return false;
    }
    return id.has_value();
  };
  for (const Event& one : service.events) {
    if (is_new(one.name, one.id, one.place)) {
      name(service, *one.id, one.name);
      payload(full + "." + one.name, *one.id, notification, one.payload, one.e2e, no_type, one.place);
    }
  }
  for (const Method& one : service.methods) {
    if (!is_new(one.name, one.id, one.place)) {
      continue;
    }
    name(service, *one.id, one.name);
    payload(full + "." + one.name, *one.id, one.fire_and_forget ? request_no_return : request, one.request,
            one.e2e, no_type, one.place);
    if (!one.fire_and_forget) {
      payload(full + "." + one.name, *one.id, response, one.response, one.e2e, one.error, one.place);
    }
  }
  for (const Field& one : service.fields) {
    const std::string element = full + "." + one.name;
    if (one.has_notifier && is_new(one.name, one.notifier, one.place)) {
      name(service, *one.notifier, one.name);
      payload(element, *one.notifier, notification, one.payload, one.e2e, no_type, one.place);
    }
    if (one.has_getter && is_new(one.name, one.getter, one.place)) {
      name(service, *one.getter, one.name + "_get");
      // Without values: of a protected getter its request has the header alone.
      payload(element, *one.getter, request, {}, one.getter_e2e, no_type, one.place);
      payload(element, *one.getter, response, one.payload, one.getter_e2e, no_type, one.place);
    }
    if (one.has_setter && is_new(one.name, one.setter, one.place)) {
      name(service, *one.setter, one.name + "_set");
      payload(element, *one.setter, request, one.payload, one.setter_e2e, no_type, one.place);
      payload(element, *one.setter, response, one.payload, one.setter_e2e, no_type, one.place);
    }
  }
  for (const Eventgroup& one : service.eventgroups) {
    name_row(one.id_is_chosen, "SOMEIP_eventgroup_identifiers", service_id_,
             fmt::format("{:04x}", someip::value(one.id)), name_of(service, one.id));
  }
  commit();
}

void WiresharkWriter::preferences() {
  std::set<unsigned> udp{30490};
  std::set<unsigned> tcp;
  for (const Machine& one : model_.machines) {
    if (one.sd_port) {
      udp.insert(*one.sd_port);
    }
  }
  for (const Instance& one : model_.instances) {
    if (one.udp_port) {
      udp.insert(*one.udp_port);
    }
    if (one.tcp_port) {
      tcp.insert(*one.tcp_port);
    }
    for (const Multicast& multicast : one.multicast) {
      udp.insert(multicast.group.port);
    }
  }
  udp.erase(0);
  std::string text = fmt::format("someip.udp.port: {}\n", fmt::join(udp, ","));
  if (!tcp.empty()) {
    text += fmt::format("someip.tcp.port: {}\n", fmt::join(tcp, ","));
  }
  // Else Wireshark knows names and types, and shows bytes.
  text += "someip.payload_dissector_activated: TRUE\n";
  written_.files.push_back({"preferences", std::move(text)});
}

Written WiresharkWriter::write() {
  // A table that is not there would be taken from Wireshark's folder for all profiles.
  for (const char* name :
       {"SOMEIP_service_identifiers", "SOMEIP_method_event_identifiers", "SOMEIP_eventgroup_identifiers",
        "SOMEIP_client_identifiers", "SOMEIP_parameter_list", "SOMEIP_parameter_base_types",
        "SOMEIP_parameter_strings", "SOMEIP_parameter_arrays", "SOMEIP_parameter_structs",
        "SOMEIP_parameter_unions", "SOMEIP_parameter_typedefs", "SOMEIP_parameter_enums"}) {
    tables_[name];
  }
  for (const Service& one : model_.services) {
    service(one);
  }
  for (const auto& [name, table] : tables_) {
    written_.files.push_back({name, "# written by Trestle\n" + table});
  }
  preferences();
  return std::move(written_);
}

}  // namespace

Written write_wireshark(const Model& model) {
  return WiresharkWriter{model}.write();
}

}  // namespace trestle::describe
