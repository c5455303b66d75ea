// Constants, and the values of enumerators.
#include "bridge/describe/read/fidl/types.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>

#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

constexpr std::size_t most_steps = 300'000;  // names that constants are computed from

std::string json_text(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (c == '\n') {
      result += "\\n";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      result += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      result += c;
    }
  }
  return result + '"';
}

bool is_one_of(std::string_view sign, std::initializer_list<std::string_view> signs) {
  return std::ranges::find(signs, sign) != signs.end();
}

}  // namespace

/// Of an enumerator without a value: one more than the one before it, in a base too.
std::optional<std::int64_t> Types::enumerator(Declared& declared, std::size_t index, int deep) {
  const TypeTree& tree = *declared.tree;
  auto& values = enumerators_[&declared];
  if (values.size() == tree.enumerators.size() && !values.empty()) {
    return values[index];
  }
  std::int64_t next = 0;
  if (!tree.base.empty()) {
    Declared* base = names_.type(tree.base, declared.scope);
    if (base != nullptr && base->state == Declared::State::done && base->type != no_type) {
      for (const Enumerator& one : all_enumerators(model_, model_.at(base->type))) {
        next = static_cast<std::int64_t>(static_cast<std::uint64_t>(one.value) + 1);
      }
    }
  }
  Scope scope = declared.scope;
  scope.inner = tree.name.text;
  std::vector<std::optional<std::int64_t>> found;
  values.assign(tree.enumerators.size(), std::nullopt);  // what refers to itself has no value
  for (const EnumeratorTree& one : tree.enumerators) {
    std::optional<std::int64_t> value = next;
    if (one.value) {
      value = whole(*one.value, scope, deep);
      if (!value && one.value->kind == Expression::Kind::text) {
        // Franca takes any text, which says nothing about bytes.
        findings_.warning(one.value->place,
                          fmt::format("the value of {} is a text and no number; {} is taken",
                                      documents::quote(one.name.text), next));
        value = next;
      }
      if (!value && !findings_.full()) {
        findings_.error(one.value->place,
                        fmt::format("the value of {} cannot be computed; expected a whole number, or "
                                    "constants and enumerators with + - * /",
                                    documents::quote(one.name.text)));
      }
    }
    enumerators_[&declared][found.size()] = value;
    next = static_cast<std::int64_t>(static_cast<std::uint64_t>(value.value_or(next)) + 1);
    found.push_back(value);
  }
  return found[index];
}

std::optional<std::int64_t> Types::whole(const Expression& expression, const Scope& scope, int deep) {
  if (deep > deepest_expression) {
    return std::nullopt;
  }
  switch (expression.kind) {
    case Expression::Kind::number:
      return to_whole(expression.text);
    case Expression::Kind::text: {
      const bool negative = expression.text.starts_with('-');
      const auto value = to_whole(std::string_view{expression.text}.substr(negative ? 1 : 0));
      return value && negative
                 ? std::optional{static_cast<std::int64_t>(0 - static_cast<std::uint64_t>(*value))}
                 : value;
    }
    case Expression::Kind::unary: {
      if (const Used part = part_named(expression, scope, deep); part.expression != nullptr) {
        return whole(*part.expression, *part.scope, deep + 1);
      }
      const auto value = expression.text == "-" ? whole(expression.parts[0], scope, deep + 1) : std::nullopt;
      return value ? std::optional{static_cast<std::int64_t>(0 - static_cast<std::uint64_t>(*value))}
                   : std::nullopt;
    }
    case Expression::Kind::binary: {
      const auto left = whole(expression.parts[0], scope, deep + 1);
      const auto right = whole(expression.parts[1], scope, deep + 1);
      if (!left || !right) {
        return std::nullopt;
      }
      std::int64_t result = 0;
      bool fails = true;
      if (expression.text == "+") {
        fails = __builtin_add_overflow(*left, *right, &result);
      } else if (expression.text == "-") {
        fails = __builtin_sub_overflow(*left, *right, &result);
      } else if (expression.text == "*") {
        fails = __builtin_mul_overflow(*left, *right, &result);
      } else if (expression.text == "/" && *right != 0 && *right != -1) {
        result = *left / *right;
        fails = false;
      }
      return fails ? std::nullopt : std::optional{result};
    }
    case Expression::Kind::name: {
      const Constantlike* found = ++steps_ > most_steps ? nullptr : names_.value(expression.text, scope);
      if (found == nullptr) {
        return std::nullopt;
      }
      if (found->constant == nullptr) {
        return enumerator(*found->enumeration, found->enumerator, deep + 1);
      }
      return follow(expression.place, *found->constant, [&] {
        const auto [known, is_new] = wholes_.emplace(found->constant, std::nullopt);
        if (is_new) {
          known->second = whole(found->constant->value, found->scope, deep + 1);
        }
        return known->second;
      });
    }
    case Expression::Kind::real:
    case Expression::Kind::truth:
    case Expression::Kind::compound:
    case Expression::Kind::bracket:
      break;
  }
  return std::nullopt;
}

/// The constant of a name, if there is one and names may still be followed.
const Constantlike* Types::constant_of(const Expression& expression, const Scope& scope) {
  const Constantlike* const found = ++steps_ > most_steps ? nullptr : names_.value(expression.text, scope);
  return found == nullptr || found->constant == nullptr ? nullptr : found;
}

/// What is computed of a constant by its name; nothing, and an error, while that constant is computed itself.
template <typename Compute>
auto Types::follow(Place name, const ConstantTree& constant, Compute compute) -> decltype(compute()) {
  const auto begin = std::ranges::find(open_, &constant);
  if (begin != open_.end()) {
    constexpr std::ptrdiff_t most_names = 10;
    std::string others;
    for (auto at = begin + 1; at != open_.end() && at - begin <= most_names; ++at) {
      others += (others.empty() ? ", through " : ", ") + documents::quote((*at)->name.text);
    }
    findings_.error(name, fmt::format("the constants form a cycle: {} refers to itself{}{}",
                                      documents::quote(constant.name.text), others,
                                      open_.end() - begin > most_names + 1 ? " and others" : ""));
    in_cycles_.insert(begin, open_.end());
    return {};
  }
  open_.push_back(&constant);
  auto result = compute();
  open_.pop_back();
  return result;
}

/// What constants and their parts, "a", "a->b" and "a->b->c", are declared as in the end; null: nothing.
Types::Used Types::meant(const Expression& expression, const Scope& scope, int deep) {
  if (deep > deepest_expression) {
    return {};
  }
  if (expression.kind == Expression::Kind::name) {
    const Constantlike* const found = constant_of(expression, scope);
    return found == nullptr ? Used{&expression, &scope}
                            : meant(found->constant->value, found->scope, deep + 1);
  }
  if (expression.kind == Expression::Kind::unary && expression.text == "->") {
    return part_of(meant(expression.parts[0], scope, deep + 1), expression.names[0].text, deep);
  }
  return {&expression, &scope};
}

Types::Used Types::part_of(const Used& whole, std::string_view field, int deep) {
  if (whole.expression == nullptr || whole.expression->kind != Expression::Kind::compound) {
    return {};
  }
  const std::vector<Name>& names = whole.expression->names;
  const auto found = std::ranges::find(names, field, &Name::text);
  const auto at = static_cast<std::size_t>(found - names.begin());
  return at < whole.expression->parts.size() ? meant(whole.expression->parts[at], *whole.scope, deep + 1)
                                             : Used{};
}

/// Of "a->b"; null for anything else.
Types::Used Types::part_named(const Expression& expression, const Scope& scope, int deep) {
  return expression.text == "->" ? meant(expression, scope, deep) : Used{};
}

/// A number of which a part may be a real one.
std::optional<double> Types::real(const Expression& expression, const Scope& scope, int deep) {
  if (deep > deepest_expression) {
    return std::nullopt;
  }
  switch (expression.kind) {
    case Expression::Kind::real: {
      double number = 0;
      const char* const end = expression.text.data() + expression.text.size();
      const auto [stop, error] = std::from_chars(expression.text.data(), end, number);
      return error == std::errc{} && stop == end ? std::optional{number} : std::nullopt;
    }
    case Expression::Kind::unary: {
      if (const Used part = part_named(expression, scope, deep); part.expression != nullptr) {
        return real(*part.expression, *part.scope, deep + 1);
      }
      const auto number = expression.text == "-" ? real(expression.parts[0], scope, deep + 1) : std::nullopt;
      return number ? std::optional{-*number} : std::nullopt;
    }
    case Expression::Kind::binary: {
      if (!is_one_of(expression.text, {"+", "-", "*", "/"})) {
        return std::nullopt;
      }
      const auto left = real(expression.parts[0], scope, deep + 1);
      const auto right = left ? real(expression.parts[1], scope, deep + 1) : std::nullopt;
      if (!right) {
        return std::nullopt;
      }
      const double result = expression.text == "+"   ? *left + *right
                            : expression.text == "-" ? *left - *right
                            : expression.text == "*" ? *left * *right
                                                     : *left / *right;
      return std::isfinite(result) ? std::optional{result} : std::nullopt;
    }
    case Expression::Kind::number:
    case Expression::Kind::text:
    case Expression::Kind::name: {
      if (const auto number = whole(expression, scope, deep)) {
        return static_cast<double>(*number);
      }
      const Constantlike* const found =
          expression.kind == Expression::Kind::name ? constant_of(expression, scope) : nullptr;
      return found == nullptr ? std::nullopt : follow(expression.place, *found->constant, [&] {
        return real(found->constant->value, found->scope, deep + 1);
      });
    }
    case Expression::Kind::truth:
    case Expression::Kind::compound:
    case Expression::Kind::bracket:
      break;
  }
  return std::nullopt;
}

std::optional<bool> Types::truth(const Expression& expression, const Scope& scope, int deep) {
  if (deep > deepest_expression) {
    return std::nullopt;
  }
  const auto part = [&](std::size_t index) { return truth(expression.parts[index], scope, deep + 1); };
  const auto number = [&](std::size_t index) { return real(expression.parts[index], scope, deep + 1); };
  const std::string_view sign = expression.text;
  switch (expression.kind) {
    case Expression::Kind::truth:
      return sign == "true";
    case Expression::Kind::name: {
      const Constantlike* const found = constant_of(expression, scope);
      return found == nullptr ? std::nullopt : follow(expression.place, *found->constant, [&] {
        return truth(found->constant->value, found->scope, deep + 1);
      });
    }
    case Expression::Kind::unary: {
      if (const Used named = part_named(expression, scope, deep); named.expression != nullptr) {
        return truth(*named.expression, *named.scope, deep + 1);
      }
      const auto value = sign == "!" ? part(0) : std::nullopt;
      return value ? std::optional{!*value} : std::nullopt;
    }
    case Expression::Kind::binary: {
      const auto left = is_one_of(sign, {"&&", "||"}) ? std::nullopt : number(0);
      if (const auto right = left ? number(1) : std::nullopt) {
        return sign == "<"    ? std::optional{*left < *right}
               : sign == "<=" ? std::optional{*left <= *right}
               : sign == ">"  ? std::optional{*left > *right}
               : sign == ">=" ? std::optional{*left >= *right}
               : sign == "==" ? std::optional{*left == *right}
               : sign == "!=" ? std::optional{*left != *right}
                              : std::nullopt;
      }
      if (left || !is_one_of(sign, {"&&", "||", "==", "!="})) {
        return std::nullopt;
      }
      const auto first = part(0);
      const auto second = first ? part(1) : std::nullopt;
      if (!second) {
        return std::nullopt;
      }
      return sign == "&&"   ? *first && *second
             : sign == "||" ? *first || *second
             : sign == "==" ? *first == *second
                            : *first != *second;
    }
    case Expression::Kind::number:
    case Expression::Kind::real:
    case Expression::Kind::text:
    case Expression::Kind::compound:
    case Expression::Kind::bracket:
      break;
  }
  return std::nullopt;
}

std::string Types::constant_text(const Expression& expression, const Scope& scope, int deep) {
  const auto left_out = [&](const std::string& why) {
    if (!in_cycles_.contains(open_.back())) {
      findings_.warning(expression.place, fmt::format("the value of the constant {}, and is left out", why));
    }
    return std::string{};
  };
  if (deep > deepest_expression) {
    return left_out(fmt::format("is made of constants more than {} deep", deepest_expression));
  }
  constexpr std::size_t most_bytes = 1'000'000;
  switch (expression.kind) {
    case Expression::Kind::real:
    case Expression::Kind::truth:
      return expression.text;
    case Expression::Kind::text:
      return json_text(expression.text);
    case Expression::Kind::unary:
      if (const Used part = part_named(expression, scope, deep); part.expression != nullptr) {
        return constant_text(*part.expression, *part.scope, deep + 1);
      }
      if (expression.text == "-" && expression.parts[0].kind == Expression::Kind::real) {
        return "-" + expression.parts[0].text;
      }
      break;
    case Expression::Kind::name: {
      const Constantlike* found = ++steps_ > most_steps ? nullptr : names_.value(expression.text, scope);
      if (found == nullptr && steps_ > most_steps) {
        findings_.error(expression.place, "the constants take too long to compute");
        return {};
      }
      if (found == nullptr) {
        findings_.error(expression.place,
                        fmt::format("{} is not known here; expected a constant or an enumerator",
                                    documents::quote(expression.text)));
        return {};
      }
      if (found->constant != nullptr) {
        return follow(expression.place, *found->constant,
                      [&] { return constant_text(found->constant->value, found->scope, deep + 1); });
      }
      break;
    }
    case Expression::Kind::compound: {
      std::string all;
      for (std::size_t i = 0; i < expression.parts.size(); ++i) {
        const std::string part = constant_text(expression.parts[i], scope, deep + 1);
        all += fmt::format("{}{}: {}", i == 0 ? "" : ", ", json_text(expression.names[i].text), part);
        if (part.empty()) {
          return {};
        }
        if (all.size() > most_bytes) {
          return left_out("is too long");
        }
      }
      return "{" + all + "}";
    }
    case Expression::Kind::bracket: {
      std::string all;
      const std::size_t step = expression.pairs ? 2 : 1;
      for (std::size_t i = 0; i + step <= expression.parts.size(); i += step) {
        const std::string first = constant_text(expression.parts[i], scope, deep + 1);
        const std::string second =
            step == 1 ? first : constant_text(expression.parts[i + 1], scope, deep + 1);
        all += i == 0 ? "" : ", ";
        all += step == 1 ? first : fmt::format("[{}, {}]", first, second);
        if (first.empty() || second.empty()) {
          return {};
        }
        if (all.size() > most_bytes) {
          return left_out("is too long");
        }
      }
      return "[" + all + "]";
    }
    case Expression::Kind::number:
    case Expression::Kind::binary:
      break;
  }
  if (const auto number = whole(expression, scope, deep)) {
    return fmt::format("{}", *number);
  }
  if (const auto number = real(expression, scope, deep)) {
    const std::string text = fmt::format("{}", *number);
    return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
  }
  if (const auto value = truth(expression, scope, deep)) {
    return *value ? "true" : "false";
  }
  return left_out("cannot be computed");
}

void Types::constants() {
  for (const Collection& collection : names_.collections()) {
    for (const ConstantTree& tree : collection.scope.in->constants) {
      const Value use = this->use(tree.type, collection.scope, {}, collection.version);
      if (in_cycles_.contains(&tree)) {
        continue;  // told with another one of its cycle
      }
      open_ = {&tree};
      std::string value = constant_text(tree.value, collection.scope);
      if (use.type == no_type || value.empty()) {
        continue;
      }
      const Type& type = resolved(model_, use.type);
      if (type.kind == Kind::primitive && type.primitive == messages::Primitive::uint64 &&
          value.starts_with('-')) {
        value =
            fmt::format("{}", static_cast<std::uint64_t>(whole(tree.value, collection.scope).value_or(0)));
      }
      model_.constants.push_back({tree.name.in_model(), use.type, std::move(value), collection.scope.model,
                                  tree.notes, tree.name.place});
    }
  }
}

}  // namespace trestle::describe::fidl
