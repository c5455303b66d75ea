#include "bridge/describe/ros_names.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {
namespace {

// Without the locale, which the functions of the C library ask.
constexpr bool is_lower(char c) {
  return c >= 'a' && c <= 'z';
}
constexpr bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}
constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
constexpr char to_lower(char c) {
  return is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c;
}
constexpr char to_upper(char c) {
  return is_lower(c) ? static_cast<char>(c - 'a' + 'A') : c;
}

/// "DTCCode_v2" -> "DTC", "Code", "v2"
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  bool begins = true;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    if (!is_lower(c) && !is_upper(c) && !is_digit(c)) {
      begins = true;
      continue;
    }
    const bool after_small = i > 0 && (is_lower(name[i - 1]) || is_digit(name[i - 1]));
    const bool before_small = i > 0 && is_upper(name[i - 1]) && i + 1 < name.size() && is_lower(name[i + 1]);
    if (begins || (is_upper(c) && (after_small || before_small))) {
      words.emplace_back();
    }
    words.back() += c;
    begins = false;
  }
  return words;
}

std::string joined(const std::vector<std::string>& words, char (*change)(char)) {
  std::string name;
  for (const std::string& word : words) {
    name += name.empty() ? "" : "_";
    std::ranges::transform(word, std::back_inserter(name), change);
  }
  return name;
}

bool is_field_name(std::string_view name) {
  return !name.empty() && is_lower(name.front()) && name.back() != '_' &&
         name.find("__") == std::string_view::npos &&
         std::ranges::all_of(name, [](char c) { return is_lower(c) || is_digit(c) || c == '_'; });
}

// Of C++, Python, C and IDL, as far as they are in lower case. Sorted.
constexpr std::array keywords{
    "abstract", "alignas",   "alignof",   "and",       "and_eq",   "any",       "as",        "asm",
    "assert",   "async",     "attribute", "auto",      "await",    "bitand",    "bitor",     "bool",
    "boolean",  "break",     "case",      "catch",     "char",     "class",     "compl",     "concept",
    "const",    "consteval", "constexpr", "constinit", "context",  "continue",  "custom",    "decltype",
    "def",      "default",   "del",       "delete",    "do",       "double",    "elif",      "else",
    "enum",     "except",    "exception", "explicit",  "export",   "extern",    "factory",   "false",
    "finally",  "fixed",     "float",     "for",       "friend",   "from",      "global",    "goto",
    "if",       "import",    "in",        "inline",    "inout",    "int",       "interface", "is",
    "lambda",   "local",     "long",      "module",    "mutable",  "namespace", "native",    "new",
    "noexcept", "nonlocal",  "not",       "not_eq",    "nullptr",  "octet",     "oneway",    "operator",
    "or",       "or_eq",     "out",       "pass",      "private",  "protected", "public",    "raise",
    "raises",   "readonly",  "register",  "requires",  "return",   "sequence",  "short",     "signed",
    "sizeof",   "static",    "string",    "struct",    "supports", "switch",    "template",  "this",
    "throw",    "true",      "try",       "typedef",   "typeid",   "typename",  "union",     "unsigned",
    "using",    "valuetype", "virtual",   "void",      "volatile", "wchar",     "while",     "with",
    "wstring",  "xor",       "xor_eq",    "yield"};

/// What CMake makes of a package, or has itself: rosidl names a target after the package. Sorted.
constexpr std::array target_names{"all",     "clean",   "depend",         "edit_cache",   "help",
                                  "install", "package", "package_source", "rebuild_cache"};

std::string without_keyword(std::string name, const char* instead) {
  const bool is_keyword = std::ranges::find(keywords, std::string_view{name}) != keywords.end();
  return is_keyword ? name + instead : name;
}

}  // namespace

std::string_view ros_only_name(const Type& type) {
  const bool is_number = type.kind == Kind::primitive;
  return is_number && type.primitive == messages::Primitive::byte        ? "byte"
         : is_number && type.primitive == messages::Primitive::character ? "char"
         : type.kind == Kind::string && type.ros_name == "wstring"       ? "wstring"
                                                                         : "";
}

std::string ros_type_name(std::string_view name) {
  const auto is_part = [](char c) { return is_lower(c) || is_upper(c) || is_digit(c); };
  if (!name.empty() && is_upper(name.front()) && std::ranges::all_of(name, is_part)) {
    return std::string{name};
  }
  std::string result;
  for (const std::string& word : words_of(name)) {
    result += to_upper(word.front());
    result += word.substr(1);
  }
  return result.empty() ? "Unnamed" : is_digit(result.front()) ? "N" + result : result;
}

std::string ros_field_name(std::string_view name) {
  std::string result = is_field_name(name) ? std::string{name} : joined(words_of(name), to_lower);
  if (result.empty()) {
    return "value";
  }
  return without_keyword(is_digit(result.front()) ? "n" + result : result, "_value");
}

std::string ros_constant_name(std::string_view name) {
  const std::string result = joined(words_of(name), to_upper);
  return result.empty() ? "UNNAMED" : is_digit(result.front()) ? "N" + result : result;
}

std::string ros_package_name(std::string_view scope) {
  const std::size_t last = scope.find_last_of("./:");
  const std::string_view part = last == std::string_view::npos ? scope : scope.substr(last + 1);
  std::string result = is_field_name(part) ? std::string{part} : joined(words_of(part), to_lower);
  if (result.empty()) {
    return {};
  }
  if (std::ranges::find(target_names, result) != target_names.end()) {
    return result + "_msgs";
  }
  return without_keyword(is_digit(result.front()) ? "n" + result : result, "_msgs");
}

std::string short_name(const std::string& name, char between) {
  constexpr std::size_t digits = 8;
  if (name.size() <= max_ros_file_name) {
    return name;
  }
  std::uint32_t sum = 2166136261U;  // FNV-1a: the same everywhere, and for ever
  for (const char character : name) {
    sum = (sum ^ static_cast<unsigned char>(character)) * 16777619U;
  }
  std::string result = name.substr(0, max_ros_file_name - digits - 1) + between;
  for (unsigned shift = digits * 4; shift > 0;) {
    shift -= 4;
    const char digit = "0123456789abcdef"[(sum >> shift) & 0xfU];
    result += is_upper(between) ? to_upper(digit) : digit;
  }
  return result;
}

std::string FreeNames::take(const std::string& name, std::string_view between) {
  if (taken_.insert(name).second) {
    return name;
  }
  unsigned& number = next_.try_emplace(name, 2U).first->second;
  for (;; ++number) {
    std::string result = name + std::string{between} + std::to_string(number);
    if (taken_.insert(result).second) {
      return result;
    }
  }
}

std::string first_free(const std::string& name, std::string_view between,
                       const std::function<bool(const std::string&)>& is_taken) {
  std::string result = name;
  for (unsigned number = 2; is_taken(result); ++number) {
    result = name;
    result += between;
    result += std::to_string(number);
  }
  return result;
}

}  // namespace trestle::describe
