#include "bridge/messages/convert/plan_compiler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>
#include <optional>
#include <set>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/default_values.hpp"
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
      const auto used = std::ranges::find(tree_.messages, name, &MessageDefinition::name);
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
      for (const Field& field : used->fields) {
        if (own.byte_orders.contains(field.name) && field.type.primitive &&
            width(*field.type.primitive) < 2) {
          complain(fmt::format("{} has a byte order for {}, which has no numbers of several bytes", name,
                               field.name));
        }
      }
      if (own.form != TypeRules::Form::structure && !(own.tags.empty() && own.fixed_strings.empty())) {
        complain(fmt::format("{} is no struct, so its fields have no tags or fixed sizes", name));
      }
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

  [[nodiscard]] const TypeRules* rules_of(const MessageDefinition& definition) const {
    const auto own = rules_.types.find(definition.name);
    return own == rules_.types.end() ? nullptr : &own->second;
  }

  /// The length field of an element: the one of its kind, or the one that follows a tag.
  [[nodiscard]] FieldWidth length(FieldWidth of_its_kind, bool is_tagged) const {
    return !is_tagged                        ? of_its_kind
           : payload_.smallest_tagged_length ? FieldWidth::bits32  // shortened afterwards
                                             : payload_.tagged_length;
  }

  Least message(const MessageDefinition& definition, const std::string& path, bool is_tagged) {
    const TypeRules* const own = rules_of(definition);
    if (own != nullptr && own->form == TypeRules::Form::choice) {
      return choice(definition, path, is_tagged);
    }
    if (own != nullptr && own->form != TypeRules::Form::structure) {
      return bits(definition, own->form, path);
    }
    const FieldWidth width = length(payload_.struct_length, is_tagged);
    if (own != nullptr && !own->tags.empty()) {
      return tagged(definition, *own, width, path);
    }
    if (width == FieldWidth::none) {
      return fields(definition, path, path.empty());
    }
    // The message itself is a struct like the ones within it.  [feat_req_someip_600]
    return enclosed({.kind = Op::Kind::structure, .length = width}, path,
                    [&] { return fields(definition, path, true); });
  }

  /// @param may_miss  whether the end of the message can be seen, so that the last fields may be missing.
  Least fields(const MessageDefinition& definition, const std::string& path, bool may_miss) {
    Least least;
    for_each_field(definition, path, [&](const Field& one, const std::string& name) {
      const std::uint32_t default_at = default_of(one);
      Least added;
      if (rules_.default_missing && (may_miss || default_at != no_default)) {
        added = enclosed({.kind = Op::Kind::field, .may_miss = may_miss, .default_at = default_at}, name,
                         [&] { return field(definition, one, name, false); });
        added.someip = may_miss ? 0 : added.someip;
      } else {
        added = field(definition, one, name, false);
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

  static constexpr std::uint32_t no_default = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t default_of(const Field& field) {
    if (!rules_.default_missing || field.default_value.empty()) {
      return no_default;
    }
    program_.defaults.push_back(default_value_of(field));
    return static_cast<std::uint32_t>(program_.defaults.size() - 1);
  }

  Least field(const MessageDefinition& definition, const Field& field, const std::string& path,
              bool is_tagged) {
    const TypeRules* const own = rules_of(definition);
    fixed_bytes_ = 0;
    if (own != nullptr && own->fixed_strings.contains(field.name)) {
      fixed_bytes_ = own->fixed_strings.find(field.name)->second;
      if (!field.type.primitive || width(*field.type.primitive) != 0) {
        complain(fmt::format("{} has a fixed size of bytes, but is no string", path));
      }
    }
    const std::endian outer = order_;
    if (own != nullptr && own->byte_orders.contains(field.name)) {
      order_ = own->byte_orders.find(field.name)->second;
    }
    const Least least = array(field.type, path, is_tagged);
    order_ = outer;
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
        const FieldWidth width = length(payload_.fixed_array_length, is_tagged);
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
        return run({.kind = Op::Kind::bools}, 1, {.path = path});
      case Primitive::string:
      case Primitive::wstring:
        return string(*type.primitive, type.string_bound, path, is_tagged);
      default: {
        const std::uint8_t bytes = width(*type.primitive);
        return run({.kind = Op::Kind::numbers, .width = bytes, .other_order = is_other_order(bytes)}, 1,
                   {.path = path});
      }
    }
  }

  Least string(Primitive primitive, std::uint32_t bound, const std::string& path, bool is_tagged) {
    const bool wide = primitive == Primitive::wstring;
    const FieldWidth width = length(fixed_bytes_ != 0 ? FieldWidth::none : payload_.string_length, is_tagged);
    const StringFrame& frame = wide ? program_.wide_strings : program_.strings;
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
            .fixed_bytes = fixed_bytes_,
            .bound = bound == 0 ? std::numeric_limits<std::uint32_t>::max() : bound},
           {.path = path});
    return {4, bytes(width) + fixed_bytes_};
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
    const FieldWidth width = length(payload_.array_length, is_tagged);
    if (width == FieldWidth::none) {
      complain(fmt::format("{} is an array of no fixed size: it needs an array length field", path));
    }
    const std::size_t op = loop({.kind = Op::Kind::sequence, .length = width}, type, path).op;
    program_.ops[op].bound = bound;
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
    const Least least =
        enclosed({.kind = Op::Kind::member,
                  .optional = optional,
                  .may_miss = rules_.default_missing,
                  .id = tag->second,
                  .default_at = default_of(one),
                  .bound = 1},
                 path, [&] {
                   FieldType type = one.type;
                   type.array = optional ? ArrayKind::none : type.array;
                   return field(definition, {.name = one.name, .type = type, .default_value = {}},
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

  Least choice(const MessageDefinition& definition, const std::string& path, bool is_tagged) {
    const FieldWidth type = payload_.union_type;
    const FieldWidth width = length(payload_.union_length, is_tagged);
    if (!fits(type, std::max<std::size_t>(1, definition.fields.size()))) {
      complain(fmt::format("{} is a union of {} types: the type field is too short", definition.name,
                           definition.fields.size()));
    }
    const std::size_t op = program_.ops.size();
    std::uint64_t longest = 0;
    bool same = true;
    const Least least =
        enclosed({.kind = Op::Kind::choice, .length = width, .is_tagged = is_tagged}, path, [&] {
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
                enclosed({.kind = Op::Kind::alternative, .bound = 1}, name,
                         [&] {
                           FieldType alone = one.type;
                           alone.array = ArrayKind::none;
                           data = field(definition, {.name = one.name, .type = alone, .default_value = {}},
                                        name + "[]", false);
                           return Least{4, 0};
                         }),
                name);
            longest = std::max(longest, data.someip);
            same = same && has_fixed_size(begin);
          });
          return all;
        });
    if (width == FieldWidth::none && !same) {  // [feat_req_someip_572]
      complain(fmt::format("{} is a union without a length field: its types must have fixed sizes",
                           definition.name));
    }
    program_.ops[op].count = longest;
    return {least.cdr, least.someip + bytes(type) + (width == FieldWidth::none ? longest : 0)};
  }

  /// Whether the operations from `begin` on always take the same number of bytes in SOME/IP.
  [[nodiscard]] bool has_fixed_size(std::size_t begin) const {
    return std::all_of(program_.ops.begin() + static_cast<std::ptrdiff_t>(begin), program_.ops.end(),
                       [](const Op& op) {
                         switch (op.kind) {
                           case Op::Kind::numbers:
                           case Op::Kind::bools:
                           case Op::Kind::bits:
                           case Op::Kind::repeat:
                           case Op::Kind::alternative:
                             return true;
                           case Op::Kind::field:
                             return !op.may_miss;
                           case Op::Kind::structure:
                           case Op::Kind::fixed_array:
                           case Op::Kind::choice:
                             return op.length == FieldWidth::none;
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
  std::endian order_;              ///< of the numbers in the present field
  std::uint32_t fixed_bytes_ = 0;  ///< of the strings in the present field
  std::string complaint_;
};

}  // namespace

tl::expected<Program, std::string> compile_program(const TypeTree& tree, const MessageRules& rules) {
  return Compiler{tree, rules}.compile();
}

}  // namespace trestle::messages
