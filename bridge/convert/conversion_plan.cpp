#include "bridge/convert/conversion_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

namespace trestle::bridge {
namespace {

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

class Compiler {
 public:
  Compiler(const TypeTree& tree, const someip::PayloadRules& rules) : tree_{tree}, rules_{rules} {
    program_.rules = rules;
  }

  tl::expected<Program, std::string> compile() {
    if (!std::has_single_bit(rules_.alignment)) {
      complain(fmt::format("an alignment of {} bytes: expected a power of two", rules_.alignment));
    } else {
      message(tree_.root(), "");
    }
    if (!complaint_.empty()) {
      return tl::unexpected{std::move(complaint_)};
    }
    return std::move(program_);
  }

 private:
  Least message(const MessageDefinition& definition, const std::string& path) {
    if (rules_.struct_length == someip::FieldWidth::none) {
      return fields(definition, path);
    }
    // The message itself is a struct like the ones within it.  [feat_req_someip_600]
    return enclosed(Op::Kind::structure, rules_.struct_length, path,
                    [&] { return fields(definition, path); });
  }

  Least fields(const MessageDefinition& definition, const std::string& path) {
    const std::string prefix = path.empty() ? "" : path + ".";
    Least least;
    const auto add = [&](const FieldType& type, const std::string& name) {
      const Least one = field(type, prefix + name);
      least.cdr += one.cdr;
      least.someip += one.someip;
      if (least.cdr > max_fixed_bytes || least.someip > max_fixed_bytes) {
        complain(fmt::format("{} has at least {} bytes, more than can be carried", prefix + name,
                             std::max(least.cdr, least.someip)));
      }
    };
    if (definition.fields.empty()) {
      // IDL knows no empty structs: what generates IDL from .msg files puts this field in.
      add({.primitive = Primitive::uint8}, "structure_needs_at_least_one_member");
    }
    for (const Field& one : definition.fields) {
      if (!complaint_.empty()) {
        break;
      }
      add(one.type, one.name);
    }
    return least;
  }

  Least field(const FieldType& type, const std::string& path) {
    if (++fields_ > max_fields_per_type) {
      complain(fmt::format("more than {} fields", max_fields_per_type));
      return {};
    }
    switch (type.array) {
      case ArrayKind::none:
        return single(type, path);
      case ArrayKind::fixed:
        if (rules_.fixed_array_length == someip::FieldWidth::none) {
          return repeat(type, path);
        }
        return enclosed(Op::Kind::fixed_array, rules_.fixed_array_length, path,
                        [&] { return repeat(type, path); });
      case ArrayKind::bounded:
        return sequence(type, path, type.array_size);
      case ArrayKind::unbounded:
        return sequence(type, path, std::numeric_limits<std::uint32_t>::max());
    }
    return {};
  }

  Least single(const FieldType& type, const std::string& path) {
    if (!type.primitive) {
      return message(tree_.messages[type.message_index], path);
    }
    switch (*type.primitive) {
      case Primitive::boolean:
        return run(Op::Kind::bools, 1, 1, {.path = path});
      case Primitive::string:
      case Primitive::wstring:
        return string(*type.primitive, type.string_bound, path);
      default:
        return run(Op::Kind::numbers, width(*type.primitive), 1, {.path = path});
    }
  }

  Least string(Primitive primitive, std::uint32_t bound, const std::string& path) {
    if (rules_.string_length == someip::FieldWidth::none) {
      complain(
          fmt::format("{} is a string: without a string length field it would need a fixed size, which .msg "
                      "files cannot give",
                      path));
    }
    append({.kind = primitive == Primitive::string ? Op::Kind::string : Op::Kind::wstring,
            .bound = bound == 0 ? std::numeric_limits<std::uint32_t>::max() : bound},
           {.path = path});
    return {4, bytes(rules_.string_length)};
  }

  /// Numbers or booleans; one operation with those just before where they are alike.
  Least run(Op::Kind kind, std::uint8_t number_width, std::uint64_t count, Label label) {
    const Least least{times(count, number_width), times(count, number_width)};
    if (program_.ops.size() > barrier_) {
      Op& last = program_.ops.back();
      if (last.kind == kind && last.width == number_width) {
        label.first = last.count;
        last.count += count;
        program_.labels.back().push_back(std::move(label));
        return least;
      }
    }
    append({.kind = kind, .width = number_width, .count = count}, std::move(label));
    return least;
  }

  Least repeat(const FieldType& type, const std::string& path) {
    const auto [op, least, barrier] = loop(Op::Kind::repeat, type, path);
    program_.ops[op].count = type.array_size;
    if (const auto inner = only_run(op)) {
      drop_from(op);
      barrier_ = barrier;
      run(inner->kind, inner->width, times(inner->count, type.array_size),
          {.stride = inner->count, .path = path});
    }
    return {times(least.cdr, type.array_size), times(least.someip, type.array_size)};
  }

  Least sequence(const FieldType& type, const std::string& path, std::uint32_t bound) {
    if (rules_.array_length == someip::FieldWidth::none) {
      complain(fmt::format("{} is an array of no fixed size: it needs an array length field", path));
    }
    const std::size_t op = loop(Op::Kind::sequence, type, path).op;
    program_.ops[op].bound = bound;
    if (const auto inner = only_run(op)) {
      drop_from(op);
      append({.kind = inner->kind == Op::Kind::bools ? Op::Kind::bool_sequence : Op::Kind::number_sequence,
              .width = inner->width,
              .count = inner->count,
              .bound = bound},
             {.stride = inner->count, .path = path});
    }
    barrier_ = program_.ops.size();
    return {4, bytes(rules_.array_length)};
  }

  struct Loop {
    std::size_t op;
    Least least;          ///< of one element
    std::size_t barrier;  ///< as it was before
  };

  /// An operation whose body is one element of `type`.
  Loop loop(Op::Kind kind, const FieldType& type, const std::string& path) {
    const std::size_t before = barrier_;
    const std::size_t op = program_.ops.size();
    append({.kind = kind}, {.path = path});
    barrier_ = program_.ops.size();
    const Least least = single(type, path + "[]");
    program_.ops[op].end = static_cast<std::uint32_t>(program_.ops.size());
    program_.ops[op].min_cdr = least.cdr;
    program_.ops[op].min_someip = least.someip;
    barrier_ = program_.ops.size();  // nothing after the loop joins its body
    return {op, least, before};
  }

  template <typename Body>
  Least enclosed(Op::Kind kind, someip::FieldWidth length, const std::string& path, const Body& body) {
    const std::size_t op = program_.ops.size();
    append({.kind = kind}, {.path = path});
    barrier_ = program_.ops.size();
    Least least = body();
    program_.ops[op].end = static_cast<std::uint32_t>(program_.ops.size());
    barrier_ = program_.ops.size();
    least.someip += bytes(length);
    return least;
  }

  /// The body of a loop, if it is but one run: then the loop can be one run itself.
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
  const someip::PayloadRules& rules_;
  Program program_;
  std::size_t barrier_ = 0;  ///< operations before this one are complete: nothing joins them
  std::size_t fields_ = 0;
  std::string complaint_;
};

}  // namespace

const char* to_string(ConversionFault fault) noexcept {
  constexpr std::array<const char*, conversion_faults> names{
      "truncated",  "bad_encapsulation", "trailing_bytes", "bound_exceeded",  "bad_bool",
      "bad_string", "bad_encoding",      "bad_length",     "length_overflow", "too_large"};
  const auto index = static_cast<std::size_t>(fault);
  return index < names.size() ? names[index] : "?";
}

std::string to_string(const ConversionError& error) {
  return fmt::format("{} at byte {}{}{}", to_string(error.fault), error.offset,
                     error.field.empty() ? "" : " in ", error.field);
}

tl::expected<ConversionPlan, std::string> ConversionPlan::compile(const TypeTree& tree,
                                                                  const someip::PayloadRules& rules,
                                                                  std::size_t reference_from) {
  auto program = Compiler{tree, rules}.compile();
  if (!program) {
    return tl::unexpected{std::move(program.error())};
  }
  return ConversionPlan{std::move(*program), reference_from};
}

}  // namespace trestle::bridge
