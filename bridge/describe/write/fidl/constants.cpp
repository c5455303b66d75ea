#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "bridge/describe/write/fidl/plan.hpp"

namespace trestle::describe::fidl_writing {
namespace {

constexpr int deepest = 60;

/// Turns a value as models have it, JSON for what is made of several, into FIDL.
class Converter {
 public:
  Converter(const Model& model, const Plan& plan, const Container& from, std::string_view text)
      : model_{model}, plan_{plan}, from_{from}, text_{text} {}

  std::optional<std::string> all(TypeIndex type) {
    auto value = this->value(type, 0);
    skip();
    return text_.empty() ? value : std::nullopt;
  }

 private:
  void skip() { text_.remove_prefix(std::min(text_.find_first_not_of(" \t\n"), text_.size())); }
  bool take(char c) {
    skip();
    if (text_.empty() || text_.front() != c) {
      return false;
    }
    text_.remove_prefix(1);
    return true;
  }
  std::optional<std::string> value(TypeIndex index, int depth);
  std::optional<std::string> members(TypeIndex type, int depth);
  std::optional<std::string> elements(const Type& type, int depth);
  std::optional<std::string> text();
  std::optional<std::string> simple(const Type& type);

  const Model& model_;
  const Plan& plan_;
  const Container& from_;
  std::string_view text_;
};

std::optional<std::string> Converter::value(TypeIndex index, int depth) {
  if (depth > deepest || index == no_type) {
    return std::nullopt;
  }
  const Type& type = resolved(model_, index);
  skip();
  switch (type.kind) {
    case Kind::structure:
    case Kind::choice:
      return members(behind_aliases(model_, index), depth);
    case Kind::array:
    case Kind::map:
      return elements(type, depth);
    case Kind::string: {
      auto content = text();
      return content ? std::optional{'"' + *content + '"'} : std::nullopt;
    }
    case Kind::primitive:
    case Kind::enumeration:
      return simple(type);
    case Kind::bytes:
    case Kind::alias:
      break;
  }
  return std::nullopt;
}

/// What stands between quotes, with its escapes, which FIDL has too.
std::optional<std::string> Converter::text() {
  if (!take('"')) {
    return std::nullopt;
  }
  std::string result;
  while (!text_.empty() && text_.front() != '"') {
    const std::size_t bytes = text_.front() == '\\' ? 2 : 1;
    result += text_.substr(0, bytes);
    text_.remove_prefix(std::min(bytes, text_.size()));
  }
  return take('"') ? std::optional{result} : std::nullopt;
}

std::optional<std::string> Converter::members(TypeIndex type, int depth) {
  if (!take('{')) {
    return std::nullopt;
  }
  std::string result = "{ ";
  const std::vector<Value> members = all_members(model_, model_.at(type));
  while (!take('}')) {
    const auto name = text();
    const auto member = std::ranges::find(members, name.value_or(""), &Value::name);
    if (member == members.end() || !take(':')) {
      return std::nullopt;
    }
    const auto value = this->value(member->type, depth + 1);
    if (!value) {
      return std::nullopt;
    }
    result += fmt::format("{}{} : {}", result.size() > 2 ? ", " : "",
                          escaped(plan_.member_name(type, member->name)), *value);
    take(',');
  }
  return result + " }";
}

std::optional<std::string> Converter::elements(const Type& type, int depth) {
  if (!take('[')) {
    return std::nullopt;
  }
  std::string result = "[ ";
  while (!take(']')) {
    std::optional<std::string> value;
    if (type.kind == Kind::map) {
      const auto key = take('[') ? this->value(type.key.type, depth + 1) : std::nullopt;
      const auto element = key && take(',') ? this->value(type.element.type, depth + 1) : std::nullopt;
      value = element && take(']') ? std::optional{*key + " => " + *element} : std::nullopt;
    } else {
      value = this->value(type.element.type, depth + 1);
    }
    if (!value) {
      return std::nullopt;
    }
    result += (result.size() > 2 ? ", " : "") + *value;
    take(',');
  }
  return result + " ]";
}

/// A number, a truth or an enumerator. FIDL wants digits on both sides of the point, a small e, and d or f.
std::optional<std::string> Converter::simple(const Type& type) {
  const std::size_t end = std::min(text_.find_first_of(",]} \n\t"), text_.size());
  std::string word{text_.substr(0, end)};
  text_.remove_prefix(end);
  if (type.kind == Kind::enumeration) {
    for (const Enumerator& one : all_enumerators(model_, type)) {
      if (fmt::format("{}", one.value) == word) {
        const TypeIndex index{static_cast<std::uint32_t>(&type - model_.types.data())};
        return plan_.reference(index, from_) + "." + escaped(plan_.member_name(index, one.name));
      }
    }
    return std::nullopt;
  }
  if (type.primitive == messages::Primitive::boolean) {
    return word == "true" || word == "True" || word == "1" ? "true" : "false";
  }
  if (word.empty() || word.find_first_not_of("+-.0123456789eExXabcdefABCDEF") != std::string::npos) {
    return std::nullopt;
  }
  if (type.primitive != messages::Primitive::float32 && type.primitive != messages::Primitive::float64) {
    return word;
  }
  std::string sign;
  if (word.front() == '-' || word.front() == '+') {
    sign = word.front() == '-' ? "-" : "";
    word.erase(0, 1);
  }
  const std::size_t e = std::min(word.find_first_of("eE"), word.size());
  std::string mantissa = word.substr(0, e);
  std::string exponent = e < word.size() ? word.substr(e + 1) : "";
  exponent.erase(0, exponent.starts_with('+') ? 1 : 0);
  if (mantissa.find('.') == std::string::npos) {
    mantissa += ".0";
  }
  mantissa = (mantissa.starts_with('.') ? "0" : "") + mantissa + (mantissa.ends_with('.') ? "0" : "");
  return sign + mantissa + (exponent.empty() ? "" : "e" + exponent) +
         (type.primitive == messages::Primitive::float32 ? "f" : "d");
}

}  // namespace

std::string constant_value(const Model& model, const Plan& plan, const Constant& constant,
                           const Container& from) {
  return Converter{model, plan, from, constant.value}.all(constant.type).value_or("");
}

}  // namespace trestle::describe::fidl_writing
