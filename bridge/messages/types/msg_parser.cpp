#include "bridge/messages/types/parsers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <limits>
#include <utility>

#include "bridge/messages/types/characters.hpp"
#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/msg_comments.hpp"
#include "bridge/messages/types/type_faults.hpp"

namespace trestle::messages {
namespace {

constexpr std::array<std::pair<std::string_view, Primitive>, 15> primitive_names{{
    {"bool", Primitive::boolean},
    {"byte", Primitive::byte},
    {"char", Primitive::character},
    {"int8", Primitive::int8},
    {"uint8", Primitive::uint8},
    {"int16", Primitive::int16},
    {"uint16", Primitive::uint16},
    {"int32", Primitive::int32},
    {"uint32", Primitive::uint32},
    {"int64", Primitive::int64},
    {"uint64", Primitive::uint64},
    {"float32", Primitive::float32},
    {"float64", Primitive::float64},
    {"string", Primitive::string},
    {"wstring", Primitive::wstring},
}};

std::optional<Primitive> primitive_named(std::string_view name) {
  const auto* const found =
      std::ranges::find(primitive_names, name, &decltype(primitive_names)::value_type::first);
  return found == primitive_names.end() ? std::nullopt : std::optional{found->second};
}

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

bool is_string(Primitive type) {
  return type == Primitive::string || type == Primitive::wstring;
}

/// The line between two parts of a .srv or .action file.
bool is_separator(std::string_view line) {
  return line.starts_with("---") && line.find_first_not_of(" \t\r", 3) == std::string_view::npos;
}

/// Reads one line; columns are counted in bytes, from 1.
class LineParser {
 public:
  LineParser(std::string_view line, int number, MessageDefinition& into)
      : line_{line}, number_{number}, into_{into} {}

  /// Adds the line's field or constant to the message; false: error() says what is wrong.
  bool parse() {
    const std::size_t comment_at = comment_begin(line_);
    read_mark(line_.substr(comment_at));
    line_ = line_.substr(0, comment_at);
    while (!line_.empty() && (is_blank(line_.back()) || line_.back() == '\r')) {  // '\r' of "\r\n"
      line_.remove_suffix(1);
    }
    skip_blanks();
    if (at_ == line_.size()) {
      if (!mark_.empty() && into_.fields.empty()) {
        into_.mark = mark_;
      }
      return true;
    }
    const auto type_at = at_;
    FieldType type;
    if (!read_type(type)) {
      return false;
    }
    if (at_ == line_.size() || !is_blank(line_[at_])) {
      return fail(at_, fmt::format("expected a blank and a name after the type, found {}", found()));
    }
    skip_blanks();
    const auto name_at = at_;
    const std::string name{read_word()};
    if (name.empty()) {
      return fail(name_at, fmt::format("expected a field or constant name, found {}", found()));
    }
    const auto same_name = [&](const auto& other) { return other.name == name; };
    if (std::ranges::any_of(into_.fields, same_name) || std::ranges::any_of(into_.constants, same_name)) {
      return fail(name_at, fmt::format("the name {} is used twice", name));
    }
    const bool blank = at_ < line_.size() && is_blank(line_[at_]);
    skip_blanks();
    if (at_ < line_.size() && line_[at_] == '=') {
      ++at_;
      return read_constant(type, type_at, name);
    }
    if (at_ < line_.size() && !blank) {
      return fail(at_, fmt::format("expected the end of the name, found {}", found()));
    }
    return read_field(std::move(type), type_at, name);
  }

  [[nodiscard]] TypeError error() const {
    return {into_.file, number_, static_cast<int>(error_at_) + 1, error_};
  }

 private:
  void read_mark(std::string_view comment) {
    if (!comment.starts_with(mark_comment) || comment.size() > max_mark_bytes) {
      return;
    }
    comment.remove_prefix(mark_comment.size());
    const std::size_t last = comment.find_last_not_of(" \t\r");
    mark_ = last == std::string_view::npos ? std::string_view{} : comment.substr(0, last + 1);
  }

  bool read_constant(const FieldType& type, std::size_t type_at, const std::string& name) {
    if (!type.primitive || type.array != ArrayKind::none) {
      return fail(type_at, "a constant must be of a primitive type, and no array");
    }
    skip_blanks();
    const std::string_view value = line_.substr(at_);
    if (value.empty() && !is_string(*type.primitive)) {
      return fail(at_, fmt::format("expected a value for the constant {}", name));
    }
    if (Complaint complaint = check_literal(*type.primitive, type.string_bound, value); !complaint.empty()) {
      return fail(at_, std::move(complaint));
    }
    into_.constants.push_back({name, *type.primitive, std::string{value}});
    return true;
  }

  bool read_field(FieldType type, std::size_t type_at, const std::string& name) {
    const std::string_view value = line_.substr(at_);
    if (!value.empty()) {
      if (!type.primitive) {
        return fail(at_, fmt::format("a field of type {} can have no default value, found \"{}\"",
                                     type.message, value));
      }
      Complaint complaint = type.array == ArrayKind::none
                                ? check_literal(*type.primitive, type.string_bound, value)
                                : check_array_literal(type, value);
      if (!complaint.empty()) {
        return fail(at_, std::move(complaint));
      }
    }
    into_.fields.push_back({name, std::move(type), std::string{value}, number_, static_cast<int>(type_at) + 1,
                            std::string{mark_}});
    return true;
  }

  bool read_type(FieldType& type) {
    const auto begin = at_;
    while (at_ < line_.size() && (is_in_word(line_[at_]) || line_[at_] == '/')) {
      ++at_;
    }
    const std::string_view name = line_.substr(begin, at_ - begin);
    if (name.empty()) {
      return fail(begin, fmt::format("expected a type, found {}", found()));
    }
    type.primitive = primitive_named(name);
    if (!type.primitive && !read_message_name(name, begin, type.message)) {
      return false;
    }
    if (line_.substr(at_).starts_with("<=")) {
      if (!type.primitive || !is_string(*type.primitive)) {
        return fail(at_, fmt::format("only string and wstring can be bounded by <=; {} cannot", name));
      }
      at_ += 2;
      if (!read_size(type.string_bound, "a string's bound")) {
        return false;
      }
    }
    return at_ == line_.size() || line_[at_] != '[' || read_array(type);
  }

  bool read_message_name(std::string_view name, std::size_t at, std::string& message) {
    if (name == "time" || name == "duration") {
      return fail(at, fmt::format("\"{}\" is a ROS 1 type; ROS 2 has builtin_interfaces/{}", name,
                                  name == "time" ? "Time" : "Duration"));
    }
    if (is_identifier(name)) {
      message = into_.name.substr(0, into_.name.find('/')) + "/msg/" + std::string{name};
      return true;
    }
    const auto full = full_type_name(name);
    if (!full) {
      return fail(
          at,
          fmt::format("\"{}\" is no type: expected a primitive type, Type, pkg/Type or pkg/msg/Type", name));
    }
    message = *full;
    return true;
  }

  bool read_array(FieldType& type) {
    ++at_;  // the bracket
    if (at_ < line_.size() && line_[at_] == ']') {
      type.array = ArrayKind::unbounded;
    } else {
      const bool bounded = line_.substr(at_).starts_with("<=");
      at_ += bounded ? 2U : 0U;
      type.array = bounded ? ArrayKind::bounded : ArrayKind::fixed;
      if (!read_size(type.array_size, "an array's size")) {
        return false;
      }
      if (at_ == line_.size() || line_[at_] != ']') {
        return fail(at_, fmt::format("expected ], found {}", found()));
      }
    }
    ++at_;
    if (at_ < line_.size() && line_[at_] == '[') {
      return fail(at_, "arrays of arrays do not exist in .msg files");
    }
    return true;
  }

  bool read_size(std::uint32_t& size, std::string_view what) {
    const auto begin = at_;
    const char* const from = line_.data() + at_;
    const char* const end = line_.data() + line_.size();
    const auto [stop, error] = std::from_chars(from, end, size);
    if (stop == from || error != std::errc{} || size == 0) {
      return fail(begin, fmt::format("expected {} from 1 to 4294967295, found {}", what, found()));
    }
    at_ += static_cast<std::size_t>(stop - from);
    return true;
  }

  std::string_view read_word() {
    const auto begin = at_;
    if (at_ < line_.size() && is_letter(line_[at_])) {
      while (at_ < line_.size() && is_in_word(line_[at_])) {
        ++at_;
      }
    }
    return line_.substr(begin, at_ - begin);
  }

  void skip_blanks() {
    while (at_ < line_.size() && is_blank(line_[at_])) {
      ++at_;
    }
  }

  /// What stands at the place of the error, for its text.
  [[nodiscard]] std::string found() const {
    const std::string_view rest = line_.substr(at_);
    const std::string_view word =
        rest.substr(0, std::min({rest.find(' ', 1), rest.find('\t', 1), std::size_t{40}}));
    return word.empty() ? "the end of the line" : fmt::format("\"{}\"", word);
  }

  bool fail(std::size_t at, std::string text) {
    error_at_ = at;
    error_ = std::move(text);
    return false;
  }

  std::string_view line_;
  int number_;
  MessageDefinition& into_;
  std::string_view mark_{};
  std::size_t at_ = 0;
  std::size_t error_at_ = 0;
  std::string error_;
};

/// The parts of a file, and up to so many errors in it.
std::vector<MessageDefinition> read_parts(std::string_view text, std::span<const std::string> names,
                                          const std::string& file, std::size_t max_errors,
                                          std::vector<TypeError>& errors) {
  std::vector<MessageDefinition> parts;
  std::ranges::transform(names, std::back_inserter(parts), [&](const std::string& name) {
    return MessageDefinition{name, file, {}, {}};
  });
  if (text.size() > max_msg_file_bytes) {
    errors.push_back({file, 0, 0, fmt::format("larger than {} bytes", max_msg_file_bytes)});
    return parts;
  }
  if (text.starts_with("\xef\xbb\xbf")) {
    text.remove_prefix(3);  // a byte order mark
  }
  std::size_t part = 0;
  MsgComments comments{parts.size() == 1};
  for (int number = 1; !text.empty() && errors.size() < max_errors; ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (parts.size() > 1 && is_separator(line)) {
      comments.end_part(parts[part]);
      if (++part == parts.size()) {
        errors.push_back(
            {file, number, 1, fmt::format("expected {} parts with --- between them, found more", part)});
        return parts;
      }
      continue;
    }
    if (LineParser parser{line, number, parts[part]}; !parser.parse()) {
      errors.push_back(parser.error());
      continue;
    }
    comments.add_line(line, parts[part]);
  }
  comments.end_part(parts[part]);
  for (MessageDefinition& one : parts) {
    std::ranges::for_each(one.fields, take_unit, &Field::comment);
    std::ranges::for_each(one.constants, take_unit, &Constant::comment);
  }
  if (part + 1 != parts.size() && errors.size() < max_errors) {
    errors.push_back(
        {file, 0, 0,
         fmt::format("expected {} parts with --- between them, found {}", parts.size(), part + 1)});
  }
  return parts;
}

}  // namespace

std::size_t comment_begin(std::string_view line) {
  char quote = 0;
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (quote != 0) {
      if (line[at] == '\\') {
        ++at;
      } else if (line[at] == quote) {
        quote = 0;
      }
    } else if (line[at] == '#') {
      return at;
    } else if ((line[at] == '"' || line[at] == '\'') && at > 0 &&
               (is_blank(line[at - 1]) || line[at - 1] == '=' || line[at - 1] == '[' ||
                line[at - 1] == ',')) {
      quote = line[at];  // elsewhere it is an apostrophe of a string without quotes
    }
  }
  if (quote != 0) {
    // A quote that is never closed quotes nothing; the check of the value complains about it.
    return std::min(line.find('#'), line.size());
  }
  return line.size();
}

const char* to_string(Primitive primitive) noexcept {
  for (const auto& [name, value] : primitive_names) {
    if (value == primitive) {
      return name.data();
    }
  }
  return "?";
}

std::string to_string(const TypeError& error) {
  if (error.file.empty()) {
    return error.text;
  }
  if (error.line == 0) {
    return fmt::format("{}: {}", error.file, error.text);
  }
  return fmt::format("{}:{}:{}: {}", error.file, error.line, error.column, error.text);
}

std::optional<std::string> full_type_name(std::string_view name) {
  const auto parts = interface_name(name);
  return parts && parts->kind == InterfaceKind::message ? std::optional{parts->full()} : std::nullopt;
}

tl::expected<std::vector<MessageDefinition>, TypeError> parse_parts(std::string_view text,
                                                                    std::span<const std::string> names,
                                                                    const std::string& file) {
  std::vector<TypeError> errors;
  std::vector<MessageDefinition> parts = read_parts(text, names, file, 1, errors);
  if (!errors.empty()) {
    return tl::unexpected{std::move(errors.front())};
  }
  return parts;
}

std::vector<TypeError> faults_of_msg(std::string_view text, const InterfaceName& name,
                                     const std::string& file) {
  std::vector<TypeError> errors;
  (void)read_parts(text, message_names(name), file, max_type_faults, errors);
  return errors;
}

tl::expected<MessageDefinition, TypeError> parse_msg(std::string_view text, const std::string& name,
                                                     const std::string& file) {
  auto parts = parse_parts(text, {&name, 1}, file);
  if (!parts) {
    return tl::unexpected{std::move(parts.error())};
  }
  return std::move(parts->front());
}

}  // namespace trestle::messages
