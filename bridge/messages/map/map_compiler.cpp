#include "bridge/messages/map/map_compiler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "bridge/documents/problems.hpp"
#include "bridge/messages/convert/default_writer.hpp"
#include "bridge/messages/convert/overestimated.hpp"
#include "bridge/messages/map/read_compiler.hpp"
#include "bridge/messages/map/table_reader.hpp"
#include "bridge/messages/map/type_paths.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

using documents::quote;

/// Where a field of the message comes from that is made.
struct Assignment {
  enum class Kind : std::uint8_t {
    copy,      ///< as it is, or by scale, offset or table
    value,     ///< always the same
    received,  ///< the time at which the message came
    time,      ///< a Time of a number, or the other way round
    nothing,   ///< its default
  };
  Kind kind = Kind::copy;
  MarkedText target;
  MarkedText source{};
  MarkedText value{};
  const MapRule* rule = nullptr;  ///< null: a constant of the payload, or a field of it that is dropped
};

std::uint32_t bound_of(std::uint32_t bound) noexcept {
  return bound == 0 ? std::numeric_limits<std::uint32_t>::max() : bound;
}

/// Names in quotes, the first few of them.
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t shown = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(shown, names.size()); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  return names.size() > shown ? fmt::format("{} and {} more", text, names.size() - shown) : text;
}

class Compiler {
 public:
  Compiler(const TypeTree& payload, const TypeTree& ros, const FieldMapping& mapping, MapDirection direction)
      : payload_{payload}, ros_{ros}, mapping_{mapping}, direction_{direction} {
    program_.from = to_ros() ? payload : ros;
    program_.to = to_ros() ? ros : payload;
  }

  CompiledMap compile() {
    check_names();
    if (!has_errors_) {
      gather();
    }
    if (!has_errors_) {
      write_fields(program_.to.root(), "");
      tell_missing();
    }
    if (!has_errors_) {
      if (!compile_reads(program_, slots_)) {
        too_many();
      }
      tell_unused();
    }
    CompiledMap result;
    if (!has_errors_) {
      program_.slots = static_cast<std::uint32_t>(slots_.size());
      program_.may_be_longer = is_overestimated(program_.from);
      result.map.emplace(std::move(program_));
    }
    result.problems = std::move(problems_);
    return result;
  }

 private:
  [[nodiscard]] bool to_ros() const noexcept { return direction_ == MapDirection::to_ros; }

  void error(documents::Mark mark, std::string text) {
    has_errors_ = true;
    problems_.push_back({mark, std::move(text)});
  }

  // What is said

  /// All names, whatever the direction is.
  void check_names() {
    for (const MapRule& rule : mapping_.rules) {
      check_name(ros_, rule.ros, "map");
      if (!rule.payload.text.empty()) {
        check_name(payload_, rule.payload, "from");
      }
    }
    for (const MarkedText& one : mapping_.dropped) {
      check_name(payload_, one, "drop");
      for (const MapRule& rule : mapping_.rules) {
        // What is read in one direction alone may be dropped on the other.
        if (!rule.only && (rule.payload.text == one.text || is_within(rule.payload.text, one.text))) {
          error(one.mark, fmt::format("drop: {} is read for {}", quote(one.text), quote(rule.ros.text)));
        }
      }
    }
    for (const PayloadConstant& one : mapping_.constants) {
      check_name(payload_, one.payload, "constants");
    }
  }

  void check_name(const TypeTree& tree, const MarkedText& name, const char* key) {
    if (const auto part = part_at(tree, name.text); !part) {
      error(name.mark, fmt::format("{}: {}", key, part.error()));
    }
  }

  /// What makes the message in this direction.
  void gather() {
    for (const MapRule& rule : mapping_.rules) {
      const bool says_nothing = rule.payload.text.empty() && !rule.value && !rule.is_received;
      if (says_nothing || (rule.only && *rule.only != direction_)) {  // the first is told when it is read
        continue;
      }
      Assignment one;
      one.target = rule.ros;
      one.source = rule.payload;
      one.rule = &rule;
      if (!to_ros()) {
        if (rule.payload.text.empty()) {
          continue;
        }
        std::swap(one.target, one.source);
      }
      if (rule.value) {
        one.kind = Assignment::Kind::value;
        one.value = *rule.value;
      } else if (rule.is_received) {
        one.kind = Assignment::Kind::received;
      } else if (rule.unit) {
        one.kind = Assignment::Kind::time;
      }
      add(std::move(one));
    }
    if (to_ros()) {
      return;
    }
    for (const PayloadConstant& one : mapping_.constants) {
      Assignment constant;
      constant.kind = Assignment::Kind::value;
      constant.target = one.payload;
      constant.value = one.value;
      add(std::move(constant));
    }
    for (const MarkedText& one : mapping_.dropped) {
      Assignment dropped;
      dropped.kind = Assignment::Kind::nothing;
      dropped.target = one;
      add(std::move(dropped));
    }
  }

  void add(Assignment one) {
    const auto is_double = [&](const std::string& other) {
      return other == one.target.text || is_within(other, one.target.text) ||
             is_within(one.target.text, other);
    };
    for (const auto& [path, other] : assignments_) {
      if (!is_double(path)) {
        continue;
      }
      if (one.rule != nullptr && other.rule != nullptr && !to_ros()) {
        error(one.target.mark,
              fmt::format("map: on the way back {} would come from {} and from {}; write `only: "
                          "someip_to_dds` in one of these rules",
                          quote(one.target.text), quote(other.rule->ros.text), quote(one.rule->ros.text)));
      } else {
        error(one.target.mark,
              fmt::format("{} is given twice, the other time as {}", quote(one.target.text), quote(path)));
      }
      return;
    }
    assignments_.emplace(one.target.text, std::move(one));
  }

  // What is made

  void write_fields(const MessageDefinition& message, const std::string& prefix) {
    if (message.fields.empty()) {
      write({.kind = WriteOp::Kind::blank}, prefix);
    }
    for (const Field& field : message.fields) {
      write_part(field.type, prefix + field.name, &field);
    }
  }

  /// @param field  null: the part is an element of one.
  void write_part(const FieldType& type, const std::string& path, const Field* field) {
    if (program_.writes.size() > max_fields_per_type) {
      return too_many();
    }
    if (const auto one = assignments_.find(path); one != assignments_.end()) {
      assign(one->second, type, field);
    } else if (!has_within(assignments_, path)) {
      if (!mapping_.others_default) {
        missing_.push_back(path);
      }
      write_default(type, path, field);
    } else if (is_message(type)) {
      write_fields(program_.to.messages[type.message_index], path + ".");
    } else {  // of fixed size, as the names were checked
      for (std::uint32_t i = 0; i < type.array_size && !has_errors_; ++i) {
        write_part(element_of(type), fmt::format("{}[{}]", path, i), nullptr);
      }
    }
  }

  void too_many() {
    error(mapping_.mark,
          fmt::format("map: with the elements of arrays these are more than {} fields", max_fields_per_type));
  }

  void write(const WriteOp& op, const std::string& path, const std::string& source = {}) {
    program_.writes.push_back(op);
    program_.write_labels.push_back(path);
    program_.write_sources.push_back(source);
  }

  void write_constant(Primitive type, std::uint64_t bits, const std::string& path) {
    write({.kind = WriteOp::Kind::constant, .width = width(type), .bits = bits}, path);
  }

  void write_text(bool is_wide, std::string text, const std::string& path) {
    if (!is_wide) {
      program_.texts.push_back(std::move(text));
      write({.kind = WriteOp::Kind::text, .index = static_cast<std::uint32_t>(program_.texts.size() - 1)},
            path);
      return;
    }
    std::vector<std::uint32_t> units;
    for (ByteView rest = std::as_bytes(std::span{text}); !rest.empty();) {
      const auto character = someip::first_utf8(rest).value_or(someip::Character{U'\ufffd', 1});
      std::array<std::byte, 4> utf16{};
      someip::put_utf16(character.code, utf16.data(), std::endian::big);
      for (std::size_t at = 0; at < someip::utf16_bytes(character.code); at += 2) {
        units.push_back(someip::load<std::uint16_t>(&utf16.at(at)));
      }
      rest = rest.subspan(character.bytes);
    }
    program_.wide_texts.push_back(std::move(units));
    write({.kind = WriteOp::Kind::wide_text,
           .index = static_cast<std::uint32_t>(program_.wide_texts.size() - 1)},
          path);
  }

  /// That of the `.msg` file, or zeros and empty arrays.
  void write_default(const FieldType& type, const std::string& path, const Field* field) {
    if (field != nullptr && !field->default_value.empty()) {
      const DefaultValue value = default_value_of(*field);
      if (value.is_sequence) {
        write_constant(Primitive::uint32, value.numbers.size() + value.strings.size(), path);
      }
      for (const std::uint64_t bits : value.numbers) {
        write_constant(value.type, bits, path);
      }
      for (const std::string& text : value.strings) {
        write_text(value.type == Primitive::wstring, text, path);
      }
      return;
    }
    if (is_sequence(type)) {
      return write_constant(Primitive::uint32, 0, path);
    }
    const std::uint64_t count = type.array == ArrayKind::fixed ? type.array_size : 1;
    if (is_number(type)) {
      const std::uint8_t bytes = width(*type.primitive);
      zeros_ += count * bytes;
      if (zeros_ > max_default_bytes) {
        return error(mapping_.mark,
                     fmt::format("map: {} and others have more than {} bytes of default values", quote(path),
                                 max_default_bytes));
      }
      return write({.kind = WriteOp::Kind::blank, .width = bytes, .count = count}, path);
    }
    for (std::uint64_t i = 0; i < count && !has_errors_; ++i) {
      if (program_.writes.size() > max_fields_per_type) {
        return too_many();
      }
      if (type.primitive) {
        write_text(*type.primitive == Primitive::wstring, "", path);
        continue;
      }
      const MessageDefinition& message = program_.to.messages[type.message_index];
      if (message.fields.empty()) {
        write({.kind = WriteOp::Kind::blank}, path);
      }
      for (const Field& inner : message.fields) {
        write_default(inner.type, fmt::format("{}.{}", path, inner.name), &inner);
      }
    }
  }

  void assign(const Assignment& one, const FieldType& type, const Field* field) {
    switch (one.kind) {
      case Assignment::Kind::nothing:
        return write_default(type, one.target.text, field);
      case Assignment::Kind::value:
        return assign_value(one, type);
      case Assignment::Kind::received:
        if (!is_time(type)) {
          return error(one.rule->time_mark,
                       fmt::format("time: {} is {}; only a builtin_interfaces/msg/Time can be a time",
                                   quote(one.target.text), type_text(type)));
        }
        program_.needs_time = true;
        return write({.kind = WriteOp::Kind::received}, one.target.text);
      case Assignment::Kind::time:
        return assign_time(one, type);
      case Assignment::Kind::copy:
        break;
    }
    const auto source = part_at(program_.from, one.source.text);
    assign_part(one, type, one.target.text, source->type, one.source.text, source->is_element);
  }

  void assign_value(const Assignment& one, const FieldType& type) {
    if (!type.primitive || type.array != ArrayKind::none) {
      return error(one.target.mark, fmt::format("{} is {}: a value is for a number, a boolean or a string",
                                                quote(one.target.text), type_text(type)));
    }
    if (width(*type.primitive) != 0) {
      const auto holder = part_at(program_.to, one.target.text)->holder;
      if (const auto bits = number_of(one.value.text, *type.primitive, *holder)) {
        return write_constant(*type.primitive, *bits, one.target.text);
      } else {
        return error(one.value.mark, "value: " + bits.error());
      }
    }
    // Bounds of wide strings count units; no character has more of them than bytes.
    if (one.value.text.size() > bound_of(type.string_bound)) {
      return error(one.value.mark, fmt::format("value: {} has at most {} characters", quote(one.target.text),
                                               type.string_bound));
    }
    write_text(*type.primitive == Primitive::wstring, one.value.text, one.target.text);
  }

  void assign_time(const Assignment& one, const FieldType& type) {
    const FieldType source = part_at(program_.from, one.source.text)->type;
    const FieldType& time = to_ros() ? type : source;
    const FieldType& number = to_ros() ? source : type;
    if (!is_time(time) && !is_duration(time)) {
      return error(
          one.rule->time_mark,
          fmt::format("time: {} is {}; a unit of time is for a builtin_interfaces/msg/Time or Duration",
                      quote(one.rule->ros.text), type_text(time)));
    }
    if (!is_number(number) || number.array != ArrayKind::none || *number.primitive == Primitive::boolean) {
      return error(one.rule->payload.mark, fmt::format("from: {} is {}; a time comes from a number",
                                                       quote(one.rule->payload.text), type_text(number)));
    }
    program_.maps.push_back({.from = *number.primitive, .to = *number.primitive});
    WriteOp op{.kind = to_ros() ? WriteOp::Kind::time : WriteOp::Kind::time_number,
               .width = width(*number.primitive),
               .unit = *one.rule->unit,
               .map = static_cast<std::uint32_t>(program_.maps.size() - 1)};
    if (to_ros()) {
      place_number(op, one.source.text);
    } else {
      op.slot = slot_of(one.source.text + ".sec");
    }
    write(op, one.target.text, one.source.text);
  }

  /// @param is_element  the source is an element of an array.
  void assign_part(const Assignment& one, const FieldType& to, const std::string& to_path,
                   const FieldType& from, const std::string& from_path, bool is_element) {
    const bool is_plain =
        one.rule->scale == 1 && one.rule->offset == 0 && one.rule->table.empty() && one.rule->back.empty();
    if (is_message(to) && is_message(from) && is_plain) {
      return assign_fields(one, to, to_path, from, from_path);
    }
    if (is_number(to) && is_number(from)) {
      const bool are_arrays = to.array != ArrayKind::none && from.array != ArrayKind::none;
      if (to.array == ArrayKind::none && from.array == ArrayKind::none) {
        return assign_number(one, to, to_path, from, from_path, is_element);
      }
      if (are_arrays && (to.array != ArrayKind::fixed || from.array != ArrayKind::fixed ||
                         to.array_size == from.array_size)) {
        return assign_numbers(one, to, to_path, from, from_path);
      }
    }
    if (is_plain && to.array == ArrayKind::none && from.array == ArrayKind::none && to.primitive &&
        to.primitive == from.primitive) {  // strings
      return write(
          {.kind = *to.primitive == Primitive::string ? WriteOp::Kind::string : WriteOp::Kind::wstring,
           .slot = slot_of(from_path),
           .bound = bound_of(to.string_bound)},
          to_path, from_path);
    }
    if (is_plain && to.array != ArrayKind::none && are_alike(from, to)) {
      program_.types.push_back(from);
      program_.types.push_back(to);
      const auto types = static_cast<std::uint32_t>(program_.types.size());
      return write({.kind = WriteOp::Kind::other,
                    .slot = slot_of(from_path),
                    .index = types - 2,
                    .to_type = types - 1},
                   to_path, from_path);
    }
    error(one.source.mark, fmt::format("{} ({}) cannot become {} ({}){}", quote(from_path), type_text(from),
                                       quote(to_path), type_text(to),
                                       !is_plain ? ": scale, offset and table are for numbers"
                                       : is_message(to) || is_message(from)
                                           ? ": give the fields one by one, as `position.x: {from: x}`"
                                           : ""));
  }

  /// A message becomes another one whose fields have the same names.
  void assign_fields(const Assignment& one, const FieldType& to, const std::string& to_path,
                     const FieldType& from, const std::string& from_path) {
    const std::vector<Field>& made = program_.to.messages[to.message_index].fields;
    const std::vector<Field>& given = program_.from.messages[from.message_index].fields;
    if (!std::ranges::equal(made, given, {}, &Field::name, &Field::name)) {
      return error(one.source.mark,
                   fmt::format("{} ({}) and {} ({}) have different fields: give them one by one, as "
                               "`position.x: {{from: x}}`",
                               quote(from_path), type_text(from), quote(to_path), type_text(to)));
    }
    if (made.empty()) {
      write({.kind = WriteOp::Kind::blank}, to_path);
    }
    for (std::size_t i = 0; i < made.size() && !has_errors_; ++i) {
      assign_part(one, made[i].type, to_path + "." + made[i].name, given[i].type,
                  from_path + "." + given[i].name, false);
    }
  }

  void assign_number(const Assignment& one, const FieldType& to, const std::string& to_path,
                     const FieldType& from, const std::string& from_path, bool is_element) {
    WriteOp op{.width = width(*to.primitive)};
    use_map(one, *from.primitive, *to.primitive, op);
    op.kind = op.is_mapped ? WriteOp::Kind::mapped : WriteOp::Kind::number;
    if (is_element) {
      place_number(op, from_path);
    } else {
      op.slot = slot_of(from_path);
    }
    write(op, to_path, from_path);
  }

  void assign_numbers(const Assignment& one, const FieldType& to, const std::string& to_path,
                      const FieldType& from, const std::string& from_path) {
    WriteOp op{.width = width(*to.primitive), .slot = slot_of(from_path)};
    if (to.array == ArrayKind::fixed) {
      op.kind = WriteOp::Kind::array;
      op.count = to.array_size;
    } else {
      op.kind = WriteOp::Kind::sequence;
      op.bound = bound_of(to.array == ArrayKind::bounded ? to.array_size : 0);
    }
    use_map(one, *from.primitive, *to.primitive, op);
    write(op, to_path, from_path);
  }

  /// An element of an array of numbers is read by the array's slot.
  void place_number(WriteOp& op, const std::string& path) {
    const std::size_t open = path.ends_with(']') ? path.rfind('[') : std::string::npos;
    op.slot = slot_of(path.substr(0, open));
    if (open != std::string::npos) {
      op.element = static_cast<std::uint32_t>(std::stoul(path.substr(open + 1)));
    }
  }

  void use_map(const Assignment& one, Primitive from, Primitive to, WriteOp& op) {
    NumberMap map{.from = from, .to = to};
    const MapRule& rule = *one.rule;
    map.scale = rule.scale;
    map.offset = rule.offset;
    map.backwards = !to_ros();
    if (map.backwards && rule.scale == 0) {
      error(rule.scale_mark,
            fmt::format("scale: with 0 there is no way back (dds_to_someip) to {}: write `only: "
                        "someip_to_dds` here, and give it under `constants` or `drop`",
                        quote(rule.payload.text)));
    }
    if (!rule.table.empty() || !rule.back.empty()) {
      const auto payload = part_at(payload_, rule.payload.text);
      const auto ros = part_at(ros_, rule.ros.text);
      TableReader reader{rule, *payload->holder, *ros->holder};
      if (to_ros()) {
        reader.read_forth(map);
      } else {
        reader.read_back(map);
      }
      for (MapProblem& problem : reader.take()) {
        error(problem.mark, std::move(problem.text));
      }
    }
    if (map.is_same()) {
      return;
    }
    op.is_mapped = true;
    op.map = static_cast<std::uint32_t>(program_.maps.size());
    program_.maps.push_back(std::move(map));
  }

  /// Whether all of one can be copied to the other, but for what bounds say.
  [[nodiscard]] bool are_alike(const FieldType& from, const FieldType& to) const {
    if (is_sequence(from) != is_sequence(to) ||
        (!is_sequence(from) && (from.array != to.array || from.array_size != to.array_size)) ||
        from.primitive.has_value() != to.primitive.has_value()) {
      return false;
    }
    if (from.primitive) {
      return are_same(*from.primitive, *to.primitive);
    }
    return std::ranges::equal(program_.from.messages[from.message_index].fields,
                              program_.to.messages[to.message_index].fields,
                              [&](const Field& one, const Field& other) {
                                return one.name == other.name && are_alike(one.type, other.type);
                              });
  }

  void tell_missing() {
    if (missing_.empty()) {
      return;
    }
    error(mapping_.mark,
          to_ros()
              ? fmt::format("map: nothing is said of {} of {}: give each a rule, or write `others: default`",
                            listed(missing_), ros_.root().name)
              : fmt::format("map: nothing says what {} of {} becomes on the way to SOME/IP: name it in a "
                            "`from`, under `constants` or under `drop`, or write `others: default`",
                            listed(missing_), payload_.root().name));
  }

  // What is read

  std::uint32_t slot_of(const std::string& path) {
    return slots_.try_emplace(path, static_cast<std::uint32_t>(slots_.size())).first->second;
  }

  /// Warns of what the message has, and of which nothing is said.
  void tell_unused() {
    std::set<std::string, std::less<>> known;
    for (const MarkedText& one : mapping_.dropped) {
      known.insert(one.text);
    }
    for (const PayloadConstant& one : mapping_.constants) {
      known.insert(one.payload.text);
    }
    for (const MapRule& rule : mapping_.rules) {
      known.insert(to_ros() ? rule.payload.text : rule.ros.text);
    }
    if (!to_ros() && mapping_.others_default) {
      return;
    }
    const std::vector<std::string> unused = unused_fields(program_.from, slots_, known);
    if (!unused.empty()) {
      problems_.push_back(
          {mapping_.mark,
           to_ros() ? fmt::format("map: ROS gets nothing of {} of {}: name it under `drop` if "
                                  "that is meant",
                                  listed(unused), payload_.root().name)
                    : fmt::format("map: SOME/IP gets nothing of {} of {}", listed(unused), ros_.root().name),
           false});
    }
  }

  const TypeTree& payload_;
  const TypeTree& ros_;
  const FieldMapping& mapping_;
  MapDirection direction_;
  MapProgram program_;
  std::vector<MapProblem> problems_;
  bool has_errors_ = false;
  std::map<std::string, Assignment, std::less<>> assignments_;  ///< by target
  SlotsByField slots_;                                          ///< of what is read
  std::vector<std::string> missing_;
  std::uint64_t zeros_ = 0;  ///< bytes
};

}  // namespace

CompiledMap compile_map(const TypeTree& payload, const TypeTree& ros, const FieldMapping& mapping,
                        MapDirection direction) {
  return Compiler{payload, ros, mapping, direction}.compile();
}

std::vector<MapProblem> check_map(const std::string& ros_type, const FieldMapping& mapping,
                                  MapDirection direction, const TypePlaces& places) {
  TypeLibrary library = TypeLibrary::in(places);
  const auto payload = library.resolve(mapping.payload.text);
  if (!payload) {
    return {{mapping.payload.mark, "payload: " + to_string(payload.error())}};
  }
  const auto ros = library.resolve(ros_type);
  if (!ros) {
    return {};  // told of where the type is named
  }
  return compile_map(*payload, *ros, mapping, direction).problems;
}

}  // namespace trestle::messages
