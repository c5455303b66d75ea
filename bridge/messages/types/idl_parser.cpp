#include "bridge/messages/types/parsers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <utility>

#include "bridge/messages/types/idl_lexer.hpp"
#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/msg_comments.hpp"
#include "bridge/messages/types/type_faults.hpp"

namespace trestle::messages {
namespace {

constexpr std::size_t max_idl_modules = 8;

using Kind = IdlToken::Kind;

constexpr std::array<std::pair<std::string_view, Primitive>, 15> idl_types{{
    {"boolean", Primitive::boolean},
    {"octet", Primitive::byte},
    {"char", Primitive::character},
    {"float", Primitive::float32},
    {"double", Primitive::float64},
    {"short", Primitive::int16},
    {"long", Primitive::int32},
    {"int8", Primitive::int8},
    {"uint8", Primitive::uint8},
    {"int16", Primitive::int16},
    {"uint16", Primitive::uint16},
    {"int32", Primitive::int32},
    {"uint32", Primitive::uint32},
    {"int64", Primitive::int64},
    {"uint64", Primitive::uint64},
}};

/// Words of IDL that begin something that cannot be carried, and why.
constexpr std::array<std::pair<std::string_view, std::string_view>, 13> refused_words{{
    {"wchar", "SOME/IP has no single wide characters; take a wstring"},
    {"enum", "rosidl does not generate enumerations; take an integer and constants"},
    {"union", "ROS 2 has no unions"},
    {"map", "ROS 2 has no maps; take a sequence of keys and values"},
    {"fixed", "ROS 2 has no fixed-point numbers"},
    {"any", "ROS 2 has no any"},
    {"bitset", "ROS 2 has no bit sets"},
    {"bitmask", "ROS 2 has no bit masks"},
    {"native", "ROS 2 has no native types"},
    {"interface", "ROS 2 writes services as two structs"},
    {"valuetype", "ROS 2 has no value types"},
    {"exception", "ROS 2 has no exceptions"},
    {"struct", "a struct within another declaration"},
}};

/// Annotations that a ROS 2 node and another DDS application, or this bridge, treat differently. `key` is not
/// among them: up to Jazzy no topic of ROS 2 has keys, whatever its type says.
constexpr std::array<std::pair<std::string_view, std::string_view>, 1> refused_annotations{{
    {"optional", "rosidl always sends such a member, others do not"},
}};

/// Adds the text of a comment without "//", "///<", "/**", "*/" and the stars that begin its lines.
void add_text(Comment& to, std::string_view text) {
  if (text.starts_with("/*")) {
    text.remove_suffix(2);
  }
  constexpr std::string_view signs = "/*!< \t";
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    add_comment(to, line.substr(std::min(line.find_first_not_of(signs), line.size())));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

template <typename Table>
auto entry_of(const Table& table, std::string_view word) {
  return std::ranges::find(table, word, &Table::value_type::first);
}

class IdlParser {
 public:
  IdlParser(std::string_view text, const InterfaceName& name, const std::string& file)
      : lexer_{text}, file_{file}, token_{lexer_.next()}, expected_{message_names(name)} {}

  bool parse() {
    while (token_.kind != Kind::end) {
      if (!definition_or_next()) {
        return false;
      }
    }
    if (all_ != nullptr && !all_->empty()) {
      return false;  // what follows from it is no help
    }
    if (structs_.size() != expected_.size()) {
      return fail(token_, fmt::format("expected struct {}, found the end of the file",
                                      fmt::join(expected_.begin() + std::ssize(structs_), expected_.end(),
                                                " and struct ")));
    }
    return std::ranges::all_of(structs_, [&](MessageDefinition& one) { return add_constants(one); });
  }

  [[nodiscard]] std::vector<MessageDefinition> take() { return std::move(structs_); }
  [[nodiscard]] TypeError error() const { return error_; }
  /// Goes on after errors, and tells all of them.
  void collect(std::vector<TypeError>& all) { all_ = &all; }

 private:
  struct PlacedConstant {
    Constant constant;
    IdlToken token;
  };

  /// After an error: goes on behind the declaration that it is in, if all errors are wanted.
  /// @param begin  how many tokens were read before it.
  bool go_on(std::size_t begin) {
    if (all_ == nullptr) {
      return false;
    }
    // Names of types that were not understood are no further errors.
    if (!lost_types_ || !error_.text.starts_with("unknown type")) {
      all_->push_back(error_);
    }
    if (all_->size() >= max_type_faults) {
      return false;
    }
    for (int open = 0; token_.kind != Kind::end && token_.kind != Kind::bad; advance()) {
      if (open == 0 && count_ != begin && is_behind_semicolon_) {
        return true;
      }
      if (open == 0 && token_.text == "}") {
        if (count_ == begin) {
          advance();
        }
        return true;
      }
      open += token_.text == "{" ? 1 : token_.text == "}" ? -1 : 0;
    }
    return false;
  }

  bool definition_or_next() {
    const std::size_t begin = count_;
    const std::size_t depth = modules_.size();
    if (definition()) {
      return true;
    }
    modules_.resize(depth);
    return go_on(begin);
  }

  bool definition() {
    if (token_.text == "module") {
      return module();
    }
    std::optional<IdlLiteral> none;
    if (token_.text == "@") {
      return annotations(none) && (none ? fail(token_, "a default value is for members") : true);
    }
    take_comments_above();
    if (token_.text == "const") {
      return constant();
    }
    if (token_.text == "typedef") {
      return type_definition();
    }
    if (token_.text == "struct") {
      return structure();
    }
    if (const auto* const refused = entry_of(refused_words, token_.text); refused != refused_words.end()) {
      return fail(token_, fmt::format("{}: {}", refused->first, refused->second));
    }
    return fail_expected("module, struct, const or typedef");
  }

  bool module() {
    IdlToken name;
    comment_ = {};
    advance();
    if (!word(name, "a module's name")) {
      return false;
    }
    if (modules_.size() == max_idl_modules) {
      return fail(name, fmt::format("modules are nested more than {} deep", max_idl_modules));
    }
    modules_.push_back(name.text);
    if (!sign("{")) {
      return false;
    }
    while (token_.text != "}") {
      if (token_.kind == Kind::end) {
        return fail_expected("}");
      }
      if (!definition_or_next()) {
        return false;
      }
    }
    modules_.pop_back();
    return sign("}") && sign(";");
  }

  bool constant() {
    const IdlToken begin = token_;
    Comment comment = std::exchange(comment_, {});
    advance();
    const IdlToken type_at = token_;
    FieldType type;
    IdlToken name;
    IdlLiteral value;
    if (!type_specification(type) || !word(name, "a constant's name") || !sign("=")) {
      return false;
    }
    if (!type.primitive || type.array != ArrayKind::none) {
      return fail(type_at, "a constant must be of a primitive type, and no array");
    }
    std::string spelled;
    if (!literal(value) || !spell(value, type, spelled) || !sign(";")) {
      return false;
    }
    take_comments_behind(begin, comment);
    auto& constants = constants_[modules_.empty() ? std::string{} : std::string{modules_.back()}];
    const bool is_new = std::ranges::none_of(
        constants, [&](const PlacedConstant& other) { return other.constant.name == name.text; });
    constants.push_back(
        {{std::string{name.text}, *type.primitive, std::move(spelled), std::move(comment)}, name});
    return is_new || fail(name, fmt::format("the name {} is used twice", name.text));
  }

  bool type_definition() {
    comment_ = {};
    advance();
    FieldType type;
    IdlToken name;
    if (!type_specification(type) || !declarator(type, name) || !sign(";")) {
      lost_types_ = true;
      return false;
    }
    const auto [place, is_new] = type_names_.emplace(name.text, type);
    return is_new || place->second == type ||
           fail(name, fmt::format("the type {} is defined twice, and differently", name.text));
  }

  bool structure() {
    Comment comment = std::exchange(comment_, {});
    advance();
    IdlToken name;
    if (!word(name, "a struct's name")) {
      return false;
    }
    const std::string full = fmt::format("{}/{}", fmt::join(modules_, "/"), name.text);
    if (structs_.size() == expected_.size() || full != expected_[structs_.size()]) {
      return fail(
          name, fmt::format(
                    "expected {}, found struct {}",
                    structs_.size() == expected_.size() ? "the end" : "struct " + expected_[structs_.size()],
                    full));
    }
    MessageDefinition into{full, file_, {}, {}, true, std::move(comment)};
    if (token_.text == ":") {
      return fail(token_, "rosidl knows no inheritance of structs");
    }
    if (!sign("{")) {
      return false;
    }
    if (token_.text == "}") {
      return fail(token_,
                  "expected a member: in ROS, an empty struct has uint8 structure_needs_at_least_one_member");
    }
    while (token_.text != "}") {
      if (const std::size_t begin = count_; !member(into) && !go_on(begin)) {
        return false;
      }
    }
    if (into.fields.size() == 1 && into.fields[0].name == "structure_needs_at_least_one_member") {
      into.fields.clear();
    }
    structs_.push_back(std::move(into));
    return sign("}") && sign(";");
  }

  bool member(MessageDefinition& into) {
    std::optional<IdlLiteral> default_value;
    if (!annotations(default_value)) {
      return false;
    }
    const IdlToken type_at = token_;
    const std::size_t first = into.fields.size();
    Comment comment = std::exchange(comment_, {});
    FieldType base;
    if (!type_specification(base)) {
      return false;
    }
    for (;;) {
      FieldType type = base;
      IdlToken name;
      if (!declarator(type, name)) {
        return false;
      }
      if (std::ranges::find(into.fields, name.text, &Field::name) != into.fields.end()) {
        return fail(name, fmt::format("the name {} is used twice", name.text));
      }
      std::string spelled;
      if (default_value && !spell(*default_value, type, spelled)) {
        return false;
      }
      into.fields.push_back(
          {std::string{name.text}, std::move(type), std::move(spelled), type_at.line, type_at.column});
      if (token_.text == ",") {
        advance();
        continue;
      }
      if (!sign(";")) {
        return false;
      }
      take_comments_behind(type_at, comment);
      for (std::size_t i = first; i < into.fields.size(); ++i) {
        into.fields[i].comment = comment;
      }
      return true;
    }
  }

  /// "name" or "name[3]".
  bool declarator(FieldType& type, IdlToken& name) {
    if (!word(name, "a name")) {
      return false;
    }
    if (token_.text != "[") {
      return true;
    }
    if (type.array != ArrayKind::none) {
      return fail(token_, "ROS 2 has no arrays of arrays");
    }
    advance();
    type.array = ArrayKind::fixed;
    if (!size(type.array_size) || !sign("]")) {
      return false;
    }
    return token_.text != "[" || fail(token_, "ROS 2 has no arrays of arrays");
  }

  bool type_specification(FieldType& type) {
    const IdlToken at = token_;
    if (at.kind != Kind::word && at.text != "::") {
      return fail_expected("a type");
    }
    if (const auto* const refused = entry_of(refused_words, at.text); refused != refused_words.end()) {
      return fail(at, fmt::format("{}: {}", refused->first, refused->second));
    }
    if (at.text == "string" || at.text == "wstring") {
      advance();
      type.primitive = at.text == "string" ? Primitive::string : Primitive::wstring;
      return token_.text != "<" || (sign("<") && size(type.string_bound) && sign(">"));
    }
    if (at.text == "sequence") {
      advance();
      return sequence(type);
    }
    if (at.text == "unsigned" || at.text == "long") {
      return long_words(type);
    }
    if (const auto* const found = entry_of(idl_types, at.text); found != idl_types.end()) {
      advance();
      type.primitive = found->second;
      return true;
    }
    return named_type(type);
  }

  bool sequence(FieldType& type) {
    if (!sign("<")) {
      return false;
    }
    const IdlToken at = token_;
    if (at.text != "sequence" && !type_specification(type)) {
      return false;
    }
    if (at.text == "sequence" || type.array != ArrayKind::none) {
      return fail(at, "ROS 2 has no sequences of arrays or sequences");
    }
    type.array = ArrayKind::unbounded;
    if (token_.text == ",") {
      advance();
      type.array = ArrayKind::bounded;
      if (!size(type.array_size)) {
        return false;
      }
    }
    return sign(">");
  }

  /// Integers of several words: "unsigned short", "long long", "unsigned long long".
  bool long_words(FieldType& type) {
    const IdlToken at = token_;
    const bool is_unsigned = at.text == "unsigned";
    if (is_unsigned) {
      advance();
    }
    if (is_unsigned && token_.text == "short") {
      advance();
      type.primitive = Primitive::uint16;
      return true;
    }
    if (token_.text != "long") {
      return fail_expected("short or long");
    }
    advance();
    if (token_.text == "double" && !is_unsigned) {
      return fail(at, "long double: SOME/IP has no numbers of more than 64 bits");
    }
    const bool is_long_long = token_.text == "long";
    if (is_long_long) {
      advance();
    }
    type.primitive = is_long_long ? (is_unsigned ? Primitive::uint64 : Primitive::int64)
                                  : (is_unsigned ? Primitive::uint32 : Primitive::int32);
    return true;
  }

  /// A type of a typedef, or "pkg::msg::Type".
  bool named_type(FieldType& type) {
    const IdlToken at = token_;
    std::string name;
    if (token_.text == "::") {
      advance();
    }
    for (;;) {
      IdlToken part;
      if (!word(part, "a type")) {
        return false;
      }
      name += part.text;
      if (token_.text != "::") {
        break;
      }
      advance();
      name += '/';
    }
    if (const auto known = type_names_.find(name); known != type_names_.end()) {
      type = known->second;
      return true;
    }
    const auto parts = interface_name(name);
    if (std::ranges::count(name, '/') != 2 || !parts || !defining_interface(*parts)) {
      return fail(at, fmt::format("unknown type {}: expected a primitive type, one of a typedef, or "
                                  "package::msg::Type",
                                  name));
    }
    type.message = std::move(name);
    return true;
  }

  /// Adds what stands directly above the next token to the comment of what begins there.
  /// @param is_annotated  the last token is one of an annotation of it.
  void take_comments_above(bool is_annotated = false) {
    const std::vector<IdlComment>& all = lexer_.comments();
    std::size_t first = all.size();
    for (int below = token_.line; first > taken_ && all[first - 1].last_line >= below - 1; --first) {
      below = all[first - 1].first_line;
    }
    for (; first < all.size(); ++first) {
      const bool is_beside_other =
          !is_annotated && all[first].first_line == last_line_ && all[first].last_line != token_.line;
      if (!is_beside_other) {
        add_text(comment_, all[first].text);
      }
    }
    taken_ = all.size();
  }

  /// Adds what stands behind the ';' of a declaration, and below that, if it is further in.
  void take_comments_behind(const IdlToken& declaration, Comment& to) {
    int line = last_line_;
    for (const IdlComment& one : lexer_.comments()) {
      const bool is_below = taken_ > 0 && one.first_line == line + 1 && one.column > declaration.column;
      if (one.last_line == token_.line || !(one.first_line == line || is_below)) {
        return;
      }
      add_text(to, one.text);
      line = one.last_line;
      ++taken_;
    }
  }

  bool annotations(std::optional<IdlLiteral>& default_value) {
    take_comments_above();
    while (token_.text == "@") {
      advance();
      const IdlToken at = token_;
      IdlToken name;
      if (!word(name, "an annotation's name")) {
        return false;
      }
      while (token_.text == "::") {
        advance();
        if (!word(name, "an annotation's name")) {
          return false;
        }
      }
      if (const auto* const refused = entry_of(refused_annotations, name.text);
          refused != refused_annotations.end()) {
        return fail(at, fmt::format("@{}: {}", refused->first, refused->second));
      }
      std::map<std::string_view, std::string> texts;
      const bool good = name.text == "default" ? default_of_member(default_value) : parameters(texts);
      if (!good) {
        return false;
      }
      if (name.text == "verbatim" && texts["language"] == "comment") {
        add_comment(comment_, texts["text"]);
      } else if (name.text == "unit" && !texts["value"].empty()) {
        comment_.unit = texts["value"];
      }
      take_comments_above(true);
    }
    return true;
  }

  /// "(value=1)" or "(1)".
  bool default_of_member(std::optional<IdlLiteral>& value) {
    if (!sign("(")) {
      return false;
    }
    if (token_.text == "value") {
      advance();
      if (!sign("=")) {
        return false;
      }
    }
    return literal(value.emplace()) && sign(")");
  }

  /// "(language="comment", text="a" "b")" or "("m")"; others are skipped.
  /// @param texts  those that are strings; one without a name is "value".
  bool parameters(std::map<std::string_view, std::string>& texts) {
    if (token_.text != "(") {
      return true;
    }
    std::string_view name = "value";
    int open = 0;
    do {
      if (token_.kind == Kind::end || token_.kind == Kind::bad) {
        return fail_expected(")");
      }
      if (token_.kind == Kind::string) {
        texts[name] += unescaped_idl_string(token_.text, token_.text.starts_with('L'));
      } else if (token_.kind == Kind::word) {
        name = token_.text;
      }
      open += token_.text == "(" ? 1 : token_.text == ")" ? -1 : 0;
      advance();
    } while (open > 0);
    return true;
  }

  bool literal(IdlLiteral& value) {
    if (token_.text == "-" || token_.text == "+") {
      value.negative = token_.text == "-";
      advance();
      if (token_.kind != Kind::number) {
        return fail_expected("a number");
      }
    }
    value.token = token_;
    if (token_.kind == Kind::string) {
      for (; token_.kind == Kind::string; advance()) {
        value.strings.push_back(token_.text);
      }
      return true;
    }
    if (token_.kind != Kind::number && token_.text != "TRUE" && token_.text != "FALSE") {
      return fail_expected("a number, TRUE, FALSE or a string");
    }
    advance();
    return true;
  }

  /// Writes the value as a .msg file does, and checks it.
  bool spell(const IdlLiteral& value, const FieldType& type, std::string& into) {
    const Complaint complaint = spell_idl_literal(value, type, into);
    return complaint.empty() || fail(value.token, complaint);
  }

  bool add_constants(MessageDefinition& to) {
    const auto found = constants_.find(to.name.substr(to.name.rfind('/') + 1) + "_Constants");
    if (found == constants_.end()) {
      return true;
    }
    for (const PlacedConstant& one : found->second) {
      if (std::ranges::find(to.fields, one.constant.name, &Field::name) != to.fields.end()) {
        return fail(one.token, fmt::format("the name {} is used twice", one.constant.name));
      }
      to.constants.push_back(one.constant);
    }
    return true;
  }

  bool size(std::uint32_t& into) {
    const std::string_view text = token_.text;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), into);
    if (token_.kind != Kind::number || error != std::errc{} || end != text.data() + text.size() ||
        into == 0) {
      return fail_expected("a size from 1 to 4294967295");
    }
    advance();
    return true;
  }

  bool word(IdlToken& into, std::string_view what) {
    if (token_.kind != Kind::word || token_.text.starts_with('_')) {
      return fail_expected(what);
    }
    into = token_;
    advance();
    return true;
  }

  bool sign(std::string_view text) {
    if (token_.kind != Kind::sign || token_.text != text) {
      return fail_expected(text);
    }
    advance();
    return true;
  }

  void advance() {
    last_line_ = token_.line;
    is_behind_semicolon_ = token_.text == ";";
    ++count_;
    taken_ = 0;
    token_ = lexer_.next();
  }

  bool fail_expected(std::string_view what) {
    if (token_.kind == Kind::bad) {
      return fail(token_, std::string{token_.text});
    }
    return fail(token_, token_.kind == Kind::end
                            ? fmt::format("expected {}, found the end of the file", what)
                            : fmt::format("expected {}, found \"{}\"", what, token_.text.substr(0, 40)));
  }

  bool fail(const IdlToken& at, std::string text) {
    error_ = {file_, at.line, at.column, std::move(text)};
    return false;
  }

  IdlLexer lexer_;
  const std::string& file_;
  IdlToken token_;                     ///< the next token
  int last_line_ = 0;                  ///< of the one before it
  std::size_t taken_ = 0;              ///< comments between the two that were used
  Comment comment_{};                  ///< of what comes next
  std::vector<std::string> expected_;  ///< the names of the structs
  std::vector<std::string_view> modules_;
  std::map<std::string, FieldType, std::less<>> type_names_;
  std::map<std::string, std::vector<PlacedConstant>, std::less<>> constants_;  ///< by their module
  std::vector<MessageDefinition> structs_;
  TypeError error_;
  std::vector<TypeError>* all_ = nullptr;  ///< errors, where all are wanted
  std::size_t count_ = 0;                  ///< tokens that were read
  bool is_behind_semicolon_ = false;
  bool lost_types_ = false;  ///< a typedef was wrong
};

}  // namespace

tl::expected<std::vector<MessageDefinition>, TypeError> parse_idl(std::string_view text,
                                                                  const InterfaceName& name,
                                                                  const std::string& file) {
  if (text.size() > max_msg_file_bytes) {
    return tl::unexpected{TypeError{file, 0, 0, fmt::format("larger than {} bytes", max_msg_file_bytes)}};
  }
  if (text.starts_with("\xef\xbb\xbf")) {
    text.remove_prefix(3);  // a byte order mark
  }
  IdlParser parser{text, name, file};
  if (!parser.parse()) {
    return tl::unexpected{parser.error()};
  }
  auto messages = parser.take();
  add_generated_messages(messages, name, file);
  return messages;
}

std::vector<TypeError> faults_of_idl(std::string_view text, const InterfaceName& name,
                                     const std::string& file) {
  if (text.size() > max_msg_file_bytes) {
    return {{file, 0, 0, fmt::format("larger than {} bytes", max_msg_file_bytes)}};
  }
  if (text.starts_with("\xef\xbb\xbf")) {
    text.remove_prefix(3);  // a byte order mark
  }
  std::vector<TypeError> all;
  IdlParser parser{text, name, file};
  parser.collect(all);
  if (!parser.parse() && all.empty()) {
    all.push_back(parser.error());
  }
  return all;
}

std::vector<TypeError> faults_of(std::string_view text, const InterfaceName& name, const std::string& file) {
  return file.ends_with(".idl") ? faults_of_idl(text, name, file) : faults_of_msg(text, name, file);
}

}  // namespace trestle::messages
