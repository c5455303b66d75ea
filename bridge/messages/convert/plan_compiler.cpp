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
#include "bridge/messages/convert/overestimated.hpp"
#include "bridge/messages/convert/program/wire_forms.hpp"
#include "bridge/messages/convert/program_builder.hpp"
#include "bridge/messages/convert/rule_check.hpp"

namespace trestle::messages {
namespace {

using someip::FieldWidth;

/// A type whose fixed parts alone are larger cannot be carried.
constexpr std::uint64_t max_fixed_bytes = max_converted_bytes;

bool is_signed(Primitive primitive) {
  return primitive == Primitive::int8 || primitive == Primitive::int16 || primitive == Primitive::int32 ||
         primitive == Primitive::int64;
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
        complain_{tree.root().name},
        order_{rules.payload.byte_order} {}

  tl::expected<Program, std::string> compile() {
    if (!std::has_single_bit(payload_.alignment)) {
      complain_(fmt::format("an alignment of {} bytes: expected a power of two", payload_.alignment));
    } else {
      check_.check_types();
      check_.check_variants();
      message(tree_.root(), "", false);
      program_.may_be_longer = is_overestimated(tree_);
      static std::atomic<std::uint64_t> programs = 0;
      program_.number = ++programs;
    }
    if (!complain_.text().empty()) {
      return tl::unexpected{complain_.text()};
    }
    return std::move(program_);
  }

 private:
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
    const TypeRules* const own = check_.rules_of(definition, use);
    ops_.end_row();
    if (own != nullptr && own->form == TypeRules::Form::choice) {
      return choice(definition, *own, use, path, is_tagged);
    }
    if (own != nullptr && own->form == TypeRules::Form::empty) {
      return ops_.pack({.width = 1}, 1, {.path = path});
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
    return ops_.enclosed({.kind = Op::Kind::structure, .length = width}, path,
                         [&] { return fields(definition, own, path, true); });
  }

  /// @param may_miss  whether the end of the message can be seen, so that the last fields may be missing.
  Least fields(const MessageDefinition& definition, const TypeRules* own, const std::string& path,
               bool may_miss) {
    Least least;
    for_each_field(definition, path, [&](const Field& one, const std::string& name) {
      // Numbers in bits are not missing one by one.
      const bool is_in_row = ops_.is_row_open() || has_bits(own, one);
      const std::uint32_t default_at = is_in_row ? no_default : default_of(one);
      Least added;
      if (rules_.default_missing && !is_in_row && (may_miss || default_at != no_default)) {
        added = ops_.enclosed({.kind = Op::Kind::field, .may_miss = may_miss, .default_at = default_at}, name,
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
      if (!complain_.text().empty()) {
        break;
      }
      visit(one, prefix + one.name);
    }
  }

  void add(Least& least, const Least& one, const std::string& path) {
    least.cdr += one.cdr;
    least.someip += one.someip;
    if (least.cdr > max_fixed_bytes || least.someip > max_fixed_bytes) {
      complain_(fmt::format("{} has at least {} bytes, more than can be carried", path,
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
        complain_(fmt::format("{} has a fixed size of bytes, but is no string", path));
      }
    }
    const FieldRules* const outer_use = std::exchange(use_, nullptr);
    if (own != nullptr && own->fields.contains(field.name)) {
      use_ = &own->fields.find(field.name)->second;
      check_.check_use(field.type, *use_, path, is_tagged);
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
      complain_(fmt::format("more than {} fields", max_fields_per_type));
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
        return ops_.enclosed({.kind = Op::Kind::fixed_array, .length = width}, path,
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
        return ops_.is_row_open() ? ops_.pack({.bits = 8, .is_bool = true}, 1, {.path = path})
                                  : ops_.run({.kind = Op::Kind::bools}, 1, {.path = path});
      case Primitive::string:
      case Primitive::wstring:
        return string(*type.primitive, type.string_bound, path, is_tagged);
      default: {
        const std::uint8_t bytes = width(*type.primitive);
        const std::uint8_t bits = use_ == nullptr ? 0 : use_->bits;
        if (bits != 0 || ops_.is_row_open()) {
          return ops_.pack(packed(*type.primitive, bits, path), 1, {.path = path});
        }
        return ops_.run({.kind = Op::Kind::numbers, .width = bytes, .other_order = is_other_order(bytes)}, 1,
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
      complain_(fmt::format("{} has a fixed size of bytes and a length field", path));
    }
    if (fixed_bytes_ == 0 && width == FieldWidth::none) {
      complain_(
          fmt::format("{} is a string: without a string length field it needs a fixed size "
                      "(fixed_strings)",
                      path));
    } else if (fixed_bytes_ != 0 && fixed_bytes_ < frame.overhead()) {
      complain_(fmt::format("{} is a string of {} bytes: BOM and terminator need {}", path, fixed_bytes_,
                            frame.overhead()));
    } else if (frame.utf16 && fixed_bytes_ % 2 != 0) {  // [feat_req_someip_640]
      complain_(fmt::format("{} is a string of {} bytes: in UTF-16 they must be even", path, fixed_bytes_));
    }
    ops_.append({.kind = wide ? Op::Kind::wstring : Op::Kind::string,
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
      complain_(fmt::format("{} has {} bits, more than its type", path, bits));
    }
    return {.width = bytes,
            .bits = bits == 0 ? static_cast<std::uint8_t>(8 * bytes) : bits,
            .is_signed = is_signed(primitive),
            .order = order_};
  }

  Least repeat(const FieldType& type, const std::string& path) {
    if (use_ != nullptr && use_->bits != 0 && type.primitive) {
      ops_.end_row();
      return ops_.pack(packed(*type.primitive, use_->bits, path), type.array_size,
                       {.stride = 1, .path = path});
    }
    const auto [op, least, barrier] =
        ops_.loop({.kind = Op::Kind::repeat}, path, [&] { return single(type, path + "[]", false); });
    program_.ops[op].count = type.array_size;
    if (const auto inner = ops_.only_run(op)) {
      ops_.drop_from(op);
      ops_.reopen(barrier);
      ops_.run(*inner, capped_times(inner->count, type.array_size), {.stride = inner->count, .path = path});
    }
    return {capped_times(least.cdr, type.array_size), capped_times(least.someip, type.array_size)};
  }

  Least sequence(const FieldType& type, const std::string& path, std::uint32_t bound, bool is_tagged) {
    const FieldWidth width =
        length(said(&FieldRules::array_length, use_, nullptr, payload_.array_length), is_tagged);
    if (use_ != nullptr && use_->bits != 0) {
      complain_(fmt::format("{} is an array of no fixed size, so its numbers have whole bytes", path));
    }
    if (width == FieldWidth::none) {
      complain_(fmt::format("{} is an array of no fixed size: it needs an array length field", path));
    }
    const std::size_t op = ops_.loop({.kind = Op::Kind::sequence, .length = width}, path,
                                     [&] { return single(type, path + "[]", false); })
                               .op;
    program_.ops[op].bound = bound;
    if (program_.ops[op].min_someip == 0) {
      complain_(fmt::format("{} is an array of no fixed size of what may have no bytes", path));
    }
    if (const auto inner = ops_.only_run(op)) {
      ops_.drop_from(op);
      ops_.append(
          {.kind = inner->kind == Op::Kind::bools ? Op::Kind::bool_sequence : Op::Kind::number_sequence,
           .width = inner->width,
           .length = width,
           .other_order = inner->other_order,
           .count = inner->count,
           .bound = bound},
          {.stride = inner->count, .path = path});
    }
    ops_.close();
    return {4, bytes(width)};
  }

  /// Each field behind a tag; none of them shares an operation with another.
  Least tagged(const MessageDefinition& definition, const TypeRules& own, FieldWidth width,
               const std::string& path) {
    if (payload_.alignment != 1) {
      complain_(fmt::format("{} has tagged members, which an alignment excludes", definition.name));
    }
    if (!path.empty() && width == FieldWidth::none) {
      complain_(
          fmt::format("{} has tagged members: it needs a struct length field to say where they end", path));
    }
    const std::size_t members_at = program_.members.size();
    program_.members.emplace_back();
    const std::size_t op = program_.ops.size();
    const Least least = ops_.enclosed(
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
      complain_(fmt::format("{} has two members with the data id {}", definition.name,
                            static_cast<unsigned>(twice->id)));
    }
    return least;
  }

  Least member(const MessageDefinition& definition, const TypeRules& own, const Field& one,
               const std::string& path, std::size_t members_at) {
    const auto tag = own.tags.find(one.name);
    if (tag == own.tags.end()) {
      complain_(fmt::format("{} has tagged members, but {} has no tag", definition.name, one.name));
      return {};
    }
    auto& members = program_.members[members_at];
    members.push_back({tag->second, static_cast<std::uint32_t>(members.size())});
    const bool optional = is_optional(one.type);
    const std::size_t op = program_.ops.size();
    const Least least =
        ops_.enclosed({.kind = Op::Kind::member,
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
      complain_(fmt::format("{} is tagged: that needs a length field for tagged members", path));
    }
    if (!complain_.text().empty()) {
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
      complain_(fmt::format("{} is a union of {} types: it needs as many different selectors",
                            definition.name, definition.fields.size()));
      result.resize(definition.fields.size());
    }
    if (payload_.union_null && different.contains(0)) {
      complain_(fmt::format("{} has the selector 0, which says that a union is empty", definition.name));
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
      complain_(fmt::format("{} is a union with a length field, and so has no fixed size", definition.name));
    }
    if (!fits(type, numbers.empty() ? 1 : std::max(1U, std::ranges::max(numbers)))) {
      complain_(fmt::format("{} is a union of {} types: the type field is too short", definition.name,
                            definition.fields.size()));
    }
    const std::size_t op = program_.ops.size();
    std::uint64_t longest = 0;
    std::uint64_t shortest = max_fixed_bytes;
    bool same = true;
    std::size_t index = 0;
    const Least least = ops_.enclosed(
        {.kind = Op::Kind::choice,
         .length = width,
         .is_tagged = is_tagged,
         .type_width = type,
         .type_first = !said(&FieldRules::union_length_first, use, &own, payload_.union_length_first)},
        path, [&] {
          Least all;
          for_each_field(definition, path, [&](const Field& one, const std::string& name) {
            if (!is_optional(one.type)) {
              complain_(
                  fmt::format("{} is a union: {} must be an array of at most one element, like "
                              "{}[<=1]",
                              definition.name, one.name,
                              one.type.primitive ? to_string(*one.type.primitive) : one.type.message));
              return;
            }
            const std::size_t begin = program_.ops.size();
            Least data;
            add(all,
                ops_.enclosed({.kind = Op::Kind::alternative, .count = numbers[index++], .bound = 1}, name,
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
            same = same && ops_.has_fixed_size(begin);
          });
          return all;
        });
    if (width == FieldWidth::none && !same && given == longest_type) {  // [feat_req_someip_572]
      complain_(fmt::format("{} is a union without a length field: its types must have fixed sizes",
                            definition.name));
    }
    if (given != longest_type && given != 0 && longest > given) {
      complain_(
          fmt::format("{} is a union of {} bytes, but has a type of {}", definition.name, given, longest));
    }
    const std::uint64_t size = given == longest_type ? longest : given;
    program_.ops[op].count = size;
    const std::uint64_t fewest = size != 0 ? size : std::min(shortest, longest);
    return {least.cdr, least.someip + bytes(type) + (width == FieldWidth::none ? fewest : 0)};
  }

  Least bits(const MessageDefinition& definition, TypeRules::Form form, const std::string& path) {
    const std::uint8_t width = form == TypeRules::Form::bits8 ? 1 : form == TypeRules::Form::bits16 ? 2 : 4;
    const std::size_t op = program_.ops.size();
    ops_.close();
    for_each_field(definition, path, [&](const Field& one, const std::string& name) {
      if (one.type.primitive != Primitive::boolean ||
          (one.type.array != ArrayKind::none && one.type.array != ArrayKind::fixed)) {
        complain_(fmt::format("{} is a bit field: {} must be a bool or an array of fixed size of bools",
                              definition.name, one.name));
        return;
      }
      const bool is_array = one.type.array == ArrayKind::fixed;
      ops_.run({.kind = Op::Kind::bools}, is_array ? one.type.array_size : 1,
               {.stride = is_array ? std::uint64_t{1} : 0, .path = name});
    });
    if (!complain_.text().empty()) {
      return {};
    }
    Op& all = program_.ops[op];
    if (all.count > 8U * width) {
      complain_(
          fmt::format("{} is a bit field of {} bits, but has {}", definition.name, 8 * width, all.count));
    }
    all.kind = Op::Kind::bits;  // [feat_req_someip_689]
    all.width = width;
    all.other_order = is_other_order(width);
    ops_.close();
    return {all.count, width};
  }

  const TypeTree& tree_;
  const MessageRules& rules_;
  const someip::PayloadRules& payload_;
  FirstComplaint complain_;
  RuleCheck check_{tree_, rules_, complain_};
  ProgramBuilder ops_{payload_, complain_};
  Program& program_{ops_.program};
  std::size_t fields_ = 0;
  std::endian order_;                ///< of the numbers in the present field
  const FieldRules* use_ = nullptr;  ///< of the present field
  std::uint32_t fixed_bytes_ = 0;    ///< of the strings in the present field
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
