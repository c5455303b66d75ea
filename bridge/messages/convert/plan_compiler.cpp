#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/default_writer.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"

namespace trestle::messages {
namespace {

using someip::FieldWidth;

/// A type whose fixed parts alone are larger cannot be carried.
constexpr std::uint64_t max_fixed_bytes = max_converted_bytes;

/// Fewest bytes of something on either side.
struct Least {
  std::uint64_t cdr = 0;
  std::uint64_t someip = 0;
};

std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > std::numeric_limits<std::uint64_t>::max() / b
             ? std::numeric_limits<std::uint64_t>::max()
             : a * b;
}

bool is_signed(Primitive primitive) {
  return primitive == Primitive::int8 || primitive == Primitive::int16 || primitive == Primitive::int32 ||
         primitive == Primitive::int64;
}

bool is_integer(Primitive primitive) {
  return width(primitive) != 0 && primitive != Primitive::boolean && primitive != Primitive::float32 &&
         primitive != Primitive::float64;
}

/// Numbers in one row of bits.
constexpr std::size_t max_packed_numbers = max_fields_per_type;

bool is_optional(const FieldType& type) {
  return type.array == ArrayKind::bounded && type.array_size == 1;
}

class Compiler {
 public:
  Compiler(const TypeTree& tree, const MessageRules& rules)
      : tree_{tree},
        rules_{rules},
        payload_{rules.payload},
        program_{rules.payload},
        order_{rules.payload.byte_order} {}

  tl::expected<Program, std::string> compile() {
    if (!std::has_single_bit(payload_.alignment)) {
      complain(fmt::format("an alignment of {} bytes: expected a power of two", payload_.alignment));
    } else {
      check_types();
      check_variants();
      message(tree_.root(), "", false);
      program_.may_be_longer = is_overestimated();
      static std::atomic<std::uint64_t> programs = 0;
      program_.number = ++programs;
    }
    if (!complaint_.empty()) {
      return tl::unexpected{std::move(complaint_)};
    }
    return std::move(program_);
  }

 private:
  /// Rules for types or fields that do not exist are mistakes.
  void check_types() {
    for (const auto& [name, own] : rules_.types) {
      const auto used = std::ranges::find(tree_.messages, type_of_rules(name), &MessageDefinition::name);
      if (used == tree_.messages.end()) {
        complain(fmt::format("there are rules for {}, which it does not contain", name));
        continue;
      }
      const auto has_field = [&](const std::string& field) {
        return std::ranges::find(used->fields, field, &Field::name) != used->fields.end();
      };
      const auto expect_fields = [&](const auto& rules, const char* what) {
        for (const auto& [field, rule] : rules) {
          if (!has_field(field)) {
            complain(fmt::format("{} has no field {}, for which there is a {}", used->name, field, what));
          }
        }
      };
      expect_fields(own.tags, "tag");
      expect_fields(own.fixed_strings, "size");
      expect_fields(own.byte_orders, "byte order");
      expect_fields(own.fields, "rule");
      for (const Field& field : used->fields) {
        if (own.byte_orders.contains(field.name) && field.type.primitive &&
            width(*field.type.primitive) < 2) {
          complain(fmt::format("{} has a byte order for {}, which has no numbers of several bytes", name,
                               field.name));
        }
      }
      const bool has_fields = own.form == TypeRules::Form::structure || own.form == TypeRules::Form::choice;
      if ((own.form != TypeRules::Form::structure && !own.tags.empty()) ||
          (!has_fields && !own.fixed_strings.empty())) {
        complain(fmt::format("{} is no struct, so its fields have no tags or fixed sizes", name));
      }
      if (!has_fields && !own.fields.empty()) {
        complain(fmt::format("{} is neither a struct nor a union, so its fields have no rules", name));
      }
      if (own.form == TypeRules::Form::empty && !used->fields.empty()) {
        complain(fmt::format("{} is empty, but has fields", name));
      }
      check_itself(own, name);
    }
  }

  /// Of a message as a whole there are only the rules of structs and unions.
  void check_itself(const TypeRules& own, const std::string& name) {
    const FieldRules& itself = own.itself;
    if (itself.array_length || itself.string_length || itself.encoding || itself.bom || itself.terminator ||
        itself.bits != 0 || !itself.variant.empty()) {
      complain(fmt::format("{} has rules for itself that only fields have", name));
    }
    check_frame(itself, own.form, name);
  }

  /// Whether a message of this form has what the rules are about.
  void check_frame(const FieldRules& rules, TypeRules::Form form, const std::string& what) {
    const bool of_union = rules.union_length || rules.union_type || rules.union_length_first ||
                          rules.union_bytes || !rules.selectors.empty();
    if (rules.struct_length && form != TypeRules::Form::structure) {
      complain(fmt::format("{} has a struct length, but is no struct", what));
    }
    if (of_union && form != TypeRules::Form::choice) {
      complain(fmt::format("{} has rules of a union, but is none", what));
    }
  }

  /// Rules that no field asks for are mistakes, too.
  void check_variants() {
    const auto is_taken = [&](const std::string& variant) {
      return std::ranges::any_of(rules_.types, [&](const auto& type) {
        return std::ranges::any_of(type.second.fields,
                                   [&](const auto& field) { return field.second.variant == variant; });
      });
    };
    for (const auto& [name, own] : rules_.types) {
      if (type_of_rules(name) != name && !is_taken(name)) {
        complain(fmt::format("there are rules for {}, which no field takes", name));
      }
    }
  }

  /// Rules of a single field that are about something which it does not have.
  void check_use(const FieldType& type, const FieldRules& use, const std::string& path, bool is_tagged) {
    const bool is_array = type.array != ArrayKind::none;
    const bool is_string = type.primitive && width(*type.primitive) == 0;
    if (use.array_length && !is_array) {
      complain(fmt::format("{} has an array length, but is no array", path));
    }
    if ((use.string_length || use.encoding || use.bom || use.terminator) && !is_string) {
      complain(fmt::format("{} has rules of a string, but is none", path));
    }
    if (use.bits != 0 && (!type.primitive || !is_integer(*type.primitive))) {
      complain(fmt::format("{} has a number of bits, but is no integer", path));
    }
    if (type.primitive) {
      check_frame(use, TypeRules::Form::empty, path);
      if (!use.variant.empty()) {
        complain(fmt::format("{} takes the rules {}, but is no message", path, use.variant));
      }
    } else {
      const MessageDefinition& nested = tree_.messages[type.message_index];
      const TypeRules* const own = rules_of(nested, &use);
      check_frame(use, own == nullptr ? TypeRules::Form::structure : own->form, path);
    }
    if (is_tagged && (use.array_length || use.bits != 0 ||
                      (!is_array && (use.string_length || use.struct_length || use.union_length)))) {
      complain(fmt::format("{} is tagged: its length field is the one of tagged members", path));
    }
  }

  /// Whether rosidl estimates too large a size: it adds padding for the numbers after the count of a
  /// sequence, which an empty sequence does not have, and a terminator for wstrings.
  [[nodiscard]] bool is_overestimated() const {
    return std::ranges::any_of(tree_.messages, [](const MessageDefinition& definition) {
      return std::ranges::any_of(definition.fields, [](const Field& field) {
        const bool is_sequence =
            field.type.array == ArrayKind::bounded || field.type.array == ArrayKind::unbounded;
        return field.type.primitive == Primitive::wstring ||
               (field.type.primitive && width(*field.type.primitive) == 8 && is_sequence);
      });
    });
  }

  /// @param use  of the message; null: there are no rules for it.
  [[nodiscard]] const TypeRules* rules_of(const MessageDefinition& definition, const FieldRules* use) {
    const bool is_variant = use != nullptr && !use->variant.empty();
    const std::string& key = is_variant ? use->variant : definition.name;
    const auto own = rules_.types.find(key);
    if (is_variant && (own == rules_.types.end() || type_of_rules(key) != definition.name)) {
      complain(fmt::format("a field takes the rules {}, which are none of {}", key, definition.name));
      return nullptr;
    }
    return own == rules_.types.end() ? nullptr : &own->second;
  }

  /// What is said of a message: by the field, by the message itself, or by the payload.
  template <typename T>
  [[nodiscard]] static T said(std::optional<T> FieldRules::*what, const FieldRules* use, const TypeRules* own,
                              T otherwise) {
    if (use != nullptr && use->*what) {
      return *(use->*what);
    }
    return own != nullptr && own->itself.*what ? *(own->itself.*what) : otherwise;
  }

  /// The length field of an element: the one of its kind, or the one that follows a tag.
  [[nodiscard]] FieldWidth length(FieldWidth of_its_kind, bool is_tagged) const {
    return !is_tagged                        ? of_its_kind
           : payload_.smallest_tagged_length ? FieldWidth::bits32  // shortened afterwards
                                             : payload_.tagged_length;
  }

  Least message(const MessageDefinition& definition, const std::string& path, bool is_tagged) {
    const FieldRules* const use = use_;
    const TypeRules* const own = rules_of(definition, use);
    end_row();
    if (own != nullptr && own->form == TypeRules::Form::choice) {
      return choice(definition, *own, use, path, is_tagged);
    }
    if (own != nullptr && own->form == TypeRules::Form::empty) {
      return pack({.width = 1}, 1, {.path = path});
    }
    if (own != nullptr && own->form != TypeRules::Form::structure) {
      return bits(definition, own->form, path);
    }
    const FieldWidth width =
        length(said(&FieldRules::struct_length, use, own, payload_.struct_length), is_tagged);
    if (own != nullptr && !own->tags.empty()) {
      return tagged(definition, *own, width, path);
    }
    if (width == FieldWidth::none) {
      return fields(definition, own, path, path.empty());
    }
    // The message itself is a struct like the ones within it.  [feat_req_someip_600]
    return enclosed({.kind = Op::Kind::structure, .length = width}, path,
                    [&] { return fields(definition, own, path, true); });
  }

  /// @param may_miss  whether the end of the message can be seen, so that the last fields may be missing.
  Least fields(const MessageDefinition& definition, const TypeRules* own, const std::string& path,
               bool may_miss) {
    Least least;
    for_each_field(definition, path, [&](const Field& one, const std::string& name) {
      // Numbers in bits are not missing one by one.
      const bool is_in_row = is_row_open() || has_bits(own, one);
      const std::uint32_t default_at = is_in_row ? no_default : default_of(one);
      Least added;
      if (rules_.default_missing && !is_in_row && (may_miss || default_at != no_default)) {
        added = enclosed({.kind = Op::Kind::field, .may_miss = may_miss, .default_at = default_at}, name,
                         [&] { return field(own, one, name, false); });
        added.someip = may_miss ? 0 : added.someip;
      } else {
        added = field(own, one, name, false);
      }
      add(least, added, name);
    });
    return least;
  }

  template <typename Visit>
  void for_each_field(const MessageDefinition& definition, const std::string& path, const Visit& visit) {
    const std::string prefix = path.empty() ? "" : path + ".";
    if (definition.fields.empty()) {
      // IDL knows no empty structs: what generates IDL from .msg files puts this field in.
      const Field only{.name = "structure_needs_at_least_one_member",
                       .type = {.primitive = Primitive::uint8},
                       .default_value = {}};
      visit(only, prefix + only.name);
    }
    for (const Field& one : definition.fields) {
      if (!complaint_.empty()) {
        break;
      }
      visit(one, prefix + one.name);
    }
  }

  void add(Least& least, const Least& one, const std::string& path) {
    least.cdr += one.cdr;
    least.someip += one.someip;
    if (least.cdr > max_fixed_bytes || least.someip > max_fixed_bytes) {
      complain(fmt::format("{} has at least {} bytes, more than can be carried", path,
                           std::max(least.cdr, least.someip)));
    }
  }

  [[nodiscard]] static bool has_bits(const TypeRules* own, const Field& field) {
    if (own == nullptr) {
      return false;
    }
    const auto use = own->fields.find(field.name);
    return use != own->fields.end() && use->second.bits != 0;
  }

  static constexpr std::uint32_t no_default = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t default_of(const Field& field) {
    if (!rules_.default_missing || field.default_value.empty()) {
      return no_default;
    }
    program_.defaults.push_back(default_value_of(field));
    return static_cast<std::uint32_t>(program_.defaults.size() - 1);
  }

  Least field(const TypeRules* own, const Field& field, const std::string& path, bool is_tagged) {
    fixed_bytes_ = 0;
    if (own != nullptr && own->fixed_strings.contains(field.name)) {
      fixed_bytes_ = own->fixed_strings.find(field.name)->second;
      if (!field.type.primitive || width(*field.type.primitive) != 0) {
        complain(fmt::format("{} has a fixed size of bytes, but is no string", path));
      }
    }
    const FieldRules* const outer_use = std::exchange(use_, nullptr);
    if (own != nullptr && own->fields.contains(field.name)) {
      use_ = &own->fields.find(field.name)->second;
      check_use(field.type, *use_, path, is_tagged);
    }
    const std::endian outer = order_;
    if (own != nullptr && own->byte_orders.contains(field.name)) {
      order_ = own->byte_orders.find(field.name)->second;
    }
    const Least least = array(field.type, path, is_tagged);
    order_ = outer;
    use_ = outer_use;
    return least;
  }

  [[nodiscard]] bool is_other_order(std::uint8_t number_width) const {
    return number_width > 1 && order_ != payload_.byte_order;
  }

  Least array(const FieldType& type, const std::string& path, bool is_tagged) {
    if (++fields_ > max_fields_per_type) {
      complain(fmt::format("more than {} fields", max_fields_per_type));
      return {};
    }
    switch (type.array) {
      case ArrayKind::none:
        return single(type, path, is_tagged);
      case ArrayKind::fixed: {
        const FieldWidth width =
            length(said(&FieldRules::array_length, use_, nullptr, payload_.fixed_array_length), is_tagged);
        if (width == FieldWidth::none) {
          return repeat(type, path);
        }
        return enclosed({.kind = Op::Kind::fixed_array, .length = width}, path,
                        [&] { return repeat(type, path); });
      }
      case ArrayKind::bounded:
        return sequence(type, path, type.array_size, is_tagged);
      case ArrayKind::unbounded:
        return sequence(type, path, std::numeric_limits<std::uint32_t>::max(), is_tagged);
    }
    return {};
  }

  Least single(const FieldType& type, const std::string& path, bool is_tagged) {
    if (!type.primitive) {
      return message(tree_.messages[type.message_index], path, is_tagged);
    }
    switch (*type.primitive) {
      case Primitive::boolean:
        return is_row_open() ? pack({.bits = 8, .is_bool = true}, 1, {.path = path})
                             : run({.kind = Op::Kind::bools}, 1, {.path = path});
      case Primitive::string:
      case Primitive::wstring:
        return string(*type.primitive, type.string_bound, path, is_tagged);
      default: {
        const std::uint8_t bytes = width(*type.primitive);
        const std::uint8_t bits = use_ == nullptr ? 0 : use_->bits;
        if (bits != 0 || is_row_open()) {
          return pack(packed(*type.primitive, bits, path), 1, {.path = path});
        }
        return run({.kind = Op::Kind::numbers, .width = bytes, .other_order = is_other_order(bytes)}, 1,
                   {.path = path});
      }
    }
  }

  Least string(Primitive primitive, std::uint32_t bound, const std::string& path, bool is_tagged) {
    const bool wide = primitive == Primitive::wstring;
    const FieldWidth width =
        length(fixed_bytes_ != 0 ? FieldWidth::none
                                 : said(&FieldRules::string_length, use_, nullptr, payload_.string_length),
               is_tagged);
    const std::uint8_t frame_at = frame_of(wide);
    const StringFrame& frame = program_.frames[frame_at];
    if (fixed_bytes_ != 0 && use_ != nullptr &&
        use_->string_length.value_or(FieldWidth::none) != FieldWidth::none) {
      complain(fmt::format("{} has a fixed size of bytes and a length field", path));
    }
    if (fixed_bytes_ == 0 && width == FieldWidth::none) {
      complain(
          fmt::format("{} is a string: without a string length field it needs a fixed size "
                      "(fixed_strings)",
                      path));
    } else if (fixed_bytes_ != 0 && fixed_bytes_ < frame.overhead()) {
      complain(fmt::format("{} is a string of {} bytes: BOM and terminator need {}", path, fixed_bytes_,
                           frame.overhead()));
    } else if (frame.utf16 && fixed_bytes_ % 2 != 0) {  // [feat_req_someip_640]
      complain(fmt::format("{} is a string of {} bytes: in UTF-16 they must be even", path, fixed_bytes_));
    }
    append({.kind = wide ? Op::Kind::wstring : Op::Kind::string,
            .length = width,
            .frame = frame_at,
            .fixed_bytes = fixed_bytes_,
            .bound = bound == 0 ? std::numeric_limits<std::uint32_t>::max() : bound},
           {.path = path});
    return {4, bytes(width) + fixed_bytes_};
  }

  /// Which of the program's frames a string in the present field has.
  std::uint8_t frame_of(bool wide) {
    using someip::StringEncoding;
    const StringEncoding encoding = said(&FieldRules::encoding, use_, nullptr, payload_.string_encoding);
    const StringFrame wanted = string_frame(
        wide ? wide_encoding(encoding) : encoding, said(&FieldRules::bom, use_, nullptr, payload_.string_bom),
        said(&FieldRules::terminator, use_, nullptr, payload_.string_terminator));
    std::vector<StringFrame>& frames = program_.frames;
    const auto is_wanted = [&](const StringFrame& frame) {
      return frame.encoding == wanted.encoding && frame.bom.size() == wanted.bom.size() &&
             frame.terminator.size() == wanted.terminator.size();
    };
    const auto found = std::ranges::find_if(frames, is_wanted);
    const auto at = static_cast<std::uint8_t>(found - frames.begin());
    if (found == frames.end()) {
      frames.push_back(wanted);
    }
    return at;
  }

  PackedNumber packed(Primitive primitive, std::uint8_t bits, const std::string& path) {
    const std::uint8_t bytes = width(primitive);
    if (bits > 8 * bytes) {
      complain(fmt::format("{} has {} bits, more than its type", path, bits));
    }
    return {.width = bytes,
            .bits = bits == 0 ? static_cast<std::uint8_t>(8 * bytes) : bits,
            .is_signed = is_signed(primitive),
            .order = order_};
  }

  /// Whether numbers in bits were the last thing, and so can go on.
  [[nodiscard]] bool is_row() const {
    return program_.ops.size() > barrier_ && program_.ops.back().kind == Op::Kind::packed;
  }
  /// Whether they ended within a byte.
  [[nodiscard]] bool is_row_open() const {
    return is_row() && !program_.packed.back().empty() && row_bits() % 8 != 0;
  }
  [[nodiscard]] std::uint32_t row_bits() const {
    const PackedNumber& last = program_.packed.back().back();
    return last.at + last.bits;
  }
  /// What follows begins with a byte.
  void end_row() {
    if (is_row()) {
      barrier_ = program_.ops.size();
    }
  }

  /// So many numbers in bits, behind those that were the last thing.
  Least pack(PackedNumber number, std::uint64_t count, Label label) {
    if (!is_row()) {
      append({.kind = Op::Kind::packed,
              .members_at = static_cast<std::uint32_t>(program_.packed.size()),
              .count = 0},
             std::move(label));
      program_.packed.emplace_back();
    } else {
      label.first = program_.ops.back().count;
      program_.labels.back().push_back(std::move(label));
    }
    Op& op = program_.ops.back();
    std::vector<PackedNumber>& row = program_.packed.back();
    if (count > max_packed_numbers - row.size()) {
      complain(fmt::format("more than {} numbers in one row of bits", max_packed_numbers));
      return {};
    }
    const Least least{times(count, number.width), 0};
    const std::uint32_t before = op.fixed_bytes;
    for (std::uint64_t i = 0; i < count; ++i) {
      number.at = row.empty() ? 0 : row_bits();
      row.push_back(number);
    }
    op.count = row.size();
    op.fixed_bytes = (row_bits() + 7) / 8;
    return {least.cdr, op.fixed_bytes - before};
  }

  /// Numbers or booleans like `op`; joined with the operation just before if that is of the same kind.
  Least run(Op op, std::uint64_t count, Label label) {
    const Least least{times(count, op.width), times(count, op.width)};
    if (program_.ops.size() > barrier_) {
      Op& last = program_.ops.back();
      if (last.kind == op.kind && last.width == op.width && last.other_order == op.other_order) {
        label.first = last.count;
        last.count += count;
        program_.labels.back().push_back(std::move(label));
        return least;
      }
    }
    op.count = count;
    append(op, std::move(label));
    return least;
  }

  Least repeat(const FieldType& type, const std::string& path) {
    if (use_ != nullptr && use_->bits != 0 && type.primitive) {
      end_row();
      return pack(packed(*type.primitive, use_->bits, path), type.array_size, {.stride = 1, .path = path});
    }
    const auto [op, least, barrier] = loop({.kind = Op::Kind::repeat}, type, path);
    program_.ops[op].count = type.array_size;
    if (const auto inner = only_run(op)) {
      drop_from(op);
      barrier_ = barrier;
      run(*inner, times(inner->count, type.array_size), {.stride = inner->count, .path = path});
    }
    return {times(least.cdr, type.array_size), times(least.someip, type.array_size)};
  }

  Least sequence(const FieldType& type, const std::string& path, std::uint32_t bound, bool is_tagged) {
    const FieldWidth width =
        length(said(&FieldRules::array_length, use_, nullptr, payload_.array_length), is_tagged);
    if (use_ != nullptr && use_->bits != 0) {
      complain(fmt::format("{} is an array of no fixed size, so its numbers have whole bytes", path));
    }
    if (width == FieldWidth::none) {
      complain(fmt::format("{} is an array of no fixed size: it needs an array length field", path));
    }
    const std::size_t op = loop({.kind = Op::Kind::sequence, .length = width}, type, path).op;
    program_.ops[op].bound = bound;
    if (program_.ops[op].min_someip == 0) {
      complain(fmt::format("{} is an array of no fixed size of what may have no bytes", path));
    }
    if (const auto inner = only_run(op)) {
      drop_from(op);
      append({.kind = inner->kind == Op::Kind::bools ? Op::Kind::bool_sequence : Op::Kind::number_sequence,
              .width = inner->width,
              .length = width,
              .other_order = inner->other_order,
              .count = inner->count,
              .bound = bound},
             {.stride = inner->count, .path = path});
    }
    barrier_ = program_.ops.size();
    return {4, bytes(width)};
  }

  /// Each field behind a tag; none of them shares an operation with another.
  Least tagged(const MessageDefinition& definition, const TypeRules& own, FieldWidth width,
               const std::string& path) {
    if (payload_.alignment != 1) {
      complain(fmt::format("{} has tagged members, which an alignment excludes", definition.name));
    }
    if (!path.empty() && width == FieldWidth::none) {
      complain(
          fmt::format("{} has tagged members: it needs a struct length field to say where they end", path));
    }
    const std::size_t members_at = program_.members.size();
    program_.members.emplace_back();
    const std::size_t op = program_.ops.size();
    const Least least = enclosed(
        {.kind = Op::Kind::tagged, .length = width, .members_at = static_cast<std::uint32_t>(members_at)},
        path, [&] {
          Least all;
          for_each_field(definition, path, [&](const Field& one, const std::string& name) {
            add(all, member(definition, own, one, name, members_at), name);
          });
          return all;
        });
    auto& members = program_.members[members_at];
    program_.ops[op].count = members.size();
    std::ranges::sort(members, {}, &MemberId::id);
    const auto twice = std::ranges::adjacent_find(members, {}, &MemberId::id);
    if (twice != members.end()) {
      complain(fmt::format("{} has two members with the data id {}", definition.name,
                           static_cast<unsigned>(twice->id)));
    }
    return least;
  }

  Least member(const MessageDefinition& definition, const TypeRules& own, const Field& one,
               const std::string& path, std::size_t members_at) {
    const auto tag = own.tags.find(one.name);
    if (tag == own.tags.end()) {
      complain(fmt::format("{} has tagged members, but {} has no tag", definition.name, one.name));
      return {};
    }
    auto& members = program_.members[members_at];
    members.push_back({tag->second, static_cast<std::uint32_t>(members.size())});
    const bool optional = is_optional(one.type);
    const std::size_t op = program_.ops.size();
    const Least least = enclosed({.kind = Op::Kind::member,
                                  .optional = optional,
                                  .may_miss = rules_.default_missing,
                                  .id = tag->second,
                                  .default_at = default_of(one),
                                  .bound = 1},
                                 path, [&] {
                                   FieldType type = one.type;
                                   type.array = optional ? ArrayKind::none : type.array;
                                   return field(&own, {.name = one.name, .type = type, .default_value = {}},
                                                optional ? path + "[]" : path, true);
                                 });
    if (payload_.tagged_length == FieldWidth::none && !payload_.smallest_tagged_length) {
      complain(fmt::format("{} is tagged: that needs a length field for tagged members", path));
    }
    if (!complaint_.empty()) {
      return {};
    }
    if (optional || rules_.default_missing) {
      return {optional ? 4 : least.cdr, 0};
    }
    // A tag may always announce a length field of 8 bits, whatever the rules say.
    const std::size_t surplus = is_number(program_.ops[op + 1]) ? 0 : bytes(length({}, true)) - 1;
    return {least.cdr, least.someip - surplus + someip::tag_bytes};
  }

  /// The type field of each of a union's fields.
  std::vector<std::uint32_t> selectors(const MessageDefinition& definition, const TypeRules& own,
                                       const FieldRules* use) {
    std::vector<std::uint32_t> result =
        use != nullptr && !use->selectors.empty() ? use->selectors : own.itself.selectors;
    if (result.empty()) {
      for (std::uint32_t i = 1; i <= definition.fields.size(); ++i) {
        result.push_back(i);
      }
    }
    const std::set<std::uint32_t> different{result.begin(), result.end()};
    if (result.size() != definition.fields.size() || different.size() != result.size()) {
      complain(fmt::format("{} is a union of {} types: it needs as many different selectors", definition.name,
                           definition.fields.size()));
      result.resize(definition.fields.size());
    }
    if (payload_.union_null && different.contains(0)) {
      complain(fmt::format("{} has the selector 0, which says that a union is empty", definition.name));
    }
    return result;
  }

  Least choice(const MessageDefinition& definition, const TypeRules& own, const FieldRules* use,
               const std::string& path, bool is_tagged) {
    const FieldWidth type = said(&FieldRules::union_type, use, &own, payload_.union_type);
    const FieldWidth width =
        length(said(&FieldRules::union_length, use, &own, payload_.union_length), is_tagged);
    const std::vector<std::uint32_t> numbers = selectors(definition, own, use);
    constexpr std::uint32_t longest_type = std::numeric_limits<std::uint32_t>::max();
    const std::uint32_t given = said(&FieldRules::union_bytes, use, &own, longest_type);
    if (given != longest_type && width != FieldWidth::none) {
      complain(fmt::format("{} is a union with a length field, and so has no fixed size", definition.name));
    }
    if (!fits(type, numbers.empty() ? 1 : std::max(1U, std::ranges::max(numbers)))) {
      complain(fmt::format("{} is a union of {} types: the type field is too short", definition.name,
                           definition.fields.size()));
    }
    const std::size_t op = program_.ops.size();
    std::uint64_t longest = 0;
    std::uint64_t shortest = max_fixed_bytes;
    bool same = true;
    std::size_t index = 0;
    const Least least = enclosed(
        {.kind = Op::Kind::choice,
         .length = width,
         .is_tagged = is_tagged,
         .type_width = type,
         .type_first = !said(&FieldRules::union_length_first, use, &own, payload_.union_length_first)},
        path, [&] {
          Least all;
          for_each_field(definition, path, [&](const Field& one, const std::string& name) {
            if (!is_optional(one.type)) {
              complain(
                  fmt::format("{} is a union: {} must be an array of at most one element, like "
                              "{}[<=1]",
                              definition.name, one.name,
                              one.type.primitive ? to_string(*one.type.primitive) : one.type.message));
              return;
            }
            const std::size_t begin = program_.ops.size();
            Least data;
            add(all,
                enclosed({.kind = Op::Kind::alternative, .count = numbers[index++], .bound = 1}, name,
                         [&] {
                           FieldType alone = one.type;
                           alone.array = ArrayKind::none;
                           data = field(&own, {.name = one.name, .type = alone, .default_value = {}},
                                        name + "[]", false);
                           return Least{4, 0};
                         }),
                name);
            longest = std::max(longest, data.someip);
            shortest = std::min(shortest, data.someip);
            same = same && has_fixed_size(begin);
          });
          return all;
        });
    if (width == FieldWidth::none && !same && given == longest_type) {  // [feat_req_someip_572]
      complain(fmt::format("{} is a union without a length field: its types must have fixed sizes",
                           definition.name));
    }
    if (given != longest_type && given != 0 && longest > given) {
      complain(
          fmt::format("{} is a union of {} bytes, but has a type of {}", definition.name, given, longest));
    }
    const std::uint64_t size = given == longest_type ? longest : given;
    program_.ops[op].count = size;
    const std::uint64_t fewest = size != 0 ? size : std::min(shortest, longest);
    return {least.cdr, least.someip + bytes(type) + (width == FieldWidth::none ? fewest : 0)};
  }

  /// Whether the operations from `begin` on always take the same number of bytes in SOME/IP.
  [[nodiscard]] bool has_fixed_size(std::size_t begin) const {
    return std::all_of(program_.ops.begin() + static_cast<std::ptrdiff_t>(begin), program_.ops.end(),
                       [](const Op& op) {
                         switch (op.kind) {
                           case Op::Kind::numbers:
                           case Op::Kind::bools:
                           case Op::Kind::bits:
                           case Op::Kind::packed:
                           case Op::Kind::repeat:
                           case Op::Kind::alternative:
                             return true;
                           case Op::Kind::field:
                             return !op.may_miss;
                           case Op::Kind::structure:
                           case Op::Kind::fixed_array:
                             return op.length == FieldWidth::none;
                           case Op::Kind::choice:
                             return op.length == FieldWidth::none && op.count != 0;
                           default:
                             return false;
                         }
                       });
  }

  Least bits(const MessageDefinition& definition, TypeRules::Form form, const std::string& path) {
    const std::uint8_t width = form == TypeRules::Form::bits8 ? 1 : form == TypeRules::Form::bits16 ? 2 : 4;
    const std::size_t op = program_.ops.size();
    barrier_ = op;
    for_each_field(definition, path, [&](const Field& one, const std::string& name) {
      if (one.type.primitive != Primitive::boolean ||
          (one.type.array != ArrayKind::none && one.type.array != ArrayKind::fixed)) {
        complain(fmt::format("{} is a bit field: {} must be a bool or an array of fixed size of bools",
                             definition.name, one.name));
        return;
      }
      const bool is_array = one.type.array == ArrayKind::fixed;
      run({.kind = Op::Kind::bools}, is_array ? one.type.array_size : 1,
          {.stride = is_array ? std::uint64_t{1} : 0, .path = name});
    });
    if (!complaint_.empty()) {
      return {};
    }
    Op& all = program_.ops[op];
    if (all.count > 8U * width) {
      complain(
          fmt::format("{} is a bit field of {} bits, but has {}", definition.name, 8 * width, all.count));
    }
    all.kind = Op::Kind::bits;  // [feat_req_someip_689]
    all.width = width;
    all.other_order = is_other_order(width);
    barrier_ = program_.ops.size();
    return {all.count, width};
  }

  struct Loop {
    std::size_t op;
    Least least;          ///< of one element
    std::size_t barrier;  ///< the barrier before the loop
  };

  /// An operation whose body is one element of `type`.
  Loop loop(const Op& kind, const FieldType& type, const std::string& path) {
    const std::size_t before = barrier_;
    const std::size_t op = program_.ops.size();
    append(kind, {.path = path});
    barrier_ = program_.ops.size();
    const Least least = single(type, path + "[]", false);
    program_.ops[op].end = static_cast<std::uint32_t>(program_.ops.size());
    program_.ops[op].min_cdr = least.cdr;
    program_.ops[op].min_someip = least.someip;
    barrier_ = program_.ops.size();  // nothing after the loop joins its body
    return {op, least, before};
  }

  template <typename Body>
  Least enclosed(const Op& kind, const std::string& path, const Body& body) {
    const std::size_t op = program_.ops.size();
    append(kind, {.path = path});
    barrier_ = program_.ops.size();
    Least least = body();
    program_.ops[op].end = static_cast<std::uint32_t>(program_.ops.size());
    barrier_ = program_.ops.size();
    least.someip += bytes(kind.length);
    return least;
  }

  /// The body of a loop, if it is a single run: then the loop can be a run itself.
  [[nodiscard]] std::optional<Op> only_run(std::size_t loop) const {
    if (program_.ops.size() != loop + 2) {
      return std::nullopt;
    }
    const Op& inner = program_.ops.back();
    const bool is_run = inner.kind == Op::Kind::numbers || inner.kind == Op::Kind::bools;
    return is_run ? std::optional{inner} : std::nullopt;
  }

  void append(const Op& op, Label label) {
    program_.ops.push_back(op);
    program_.labels.emplace_back().push_back(std::move(label));
  }

  void drop_from(std::size_t op) {
    program_.ops.resize(op);
    program_.labels.resize(op);
  }

  void complain(std::string text) {
    if (complaint_.empty()) {
      complaint_ = fmt::format("{} cannot be carried: {}", tree_.root().name, text);
    }
  }

  const TypeTree& tree_;
  const MessageRules& rules_;
  const someip::PayloadRules& payload_;
  Program program_;
  std::size_t barrier_ = 0;  ///< operations before this one are complete: nothing joins them
  std::size_t fields_ = 0;
  std::endian order_;                ///< of the numbers in the present field
  const FieldRules* use_ = nullptr;  ///< of the present field
  std::uint32_t fixed_bytes_ = 0;    ///< of the strings in the present field
  std::string complaint_;
};

}  // namespace

tl::expected<ConversionPlan, std::string> ConversionPlan::compile(const TypeTree& tree,
                                                                  const MessageRules& rules,
                                                                  std::size_t reference_from,
                                                                  Execution execution) {
  auto program = Compiler{tree, rules}.compile();
  if (!program) {
    return tl::unexpected{std::move(program.error())};
  }
  if (execution == Execution::quick) {
    quick::choose(*program);
  }
  return ConversionPlan{std::move(*program), reference_from};
}

}  // namespace trestle::messages
