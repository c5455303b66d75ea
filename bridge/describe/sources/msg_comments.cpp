#include "bridge/describe/sources/msg_comments.hpp"

#include <algorithm>
#include <cstddef>
#include <string>

#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/parsers.hpp"

namespace trestle::describe {
namespace {

using messages::trimmed;

bool is_comment(std::string_view line) {
  return trimmed(line).starts_with('#');
}

/// Lines of dashes and the like say nothing. Bytes of other alphabets do.
bool says_something(std::string_view text) {
  return std::ranges::any_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           (static_cast<unsigned char>(c) & 0x80U) != 0;
  });
}

/// @param comment  with its '#'
void add(Notes& notes, std::string_view comment) {
  constexpr std::string_view unit = "unit:";
  comment = trimmed(comment);
  if (comment.starts_with(messages::mark_comment)) {
    return;
  }
  comment.remove_prefix(std::min(comment.find_first_not_of('#'), comment.size()));
  comment = trimmed(comment);
  if (!says_something(comment)) {
    return;
  }
  if (comment.starts_with(unit)) {
    notes.unit = trimmed(comment.substr(unit.size()));
    return;
  }
  notes.description += notes.description.empty() ? "" : "\n";
  notes.description += comment;
}

}  // namespace

MsgComments::MsgComments(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) {
    text.remove_prefix(3);  // a byte order mark
  }
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    lines_.push_back(line.substr(0, line.find_last_not_of('\r') + 1));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

Notes MsgComments::of(const messages::Field& field) const {
  Notes notes;
  if (field.line < 1 || static_cast<std::size_t>(field.line) > lines_.size()) {
    return notes;
  }
  const std::size_t at = static_cast<std::size_t>(field.line) - 1;
  std::size_t first = at;
  while (first > 0 && is_comment(lines_[first - 1])) {
    --first;
  }
  for (; first < at; ++first) {
    add(notes, lines_[first]);
  }
  add(notes, lines_[at].substr(messages::comment_begin(lines_[at])));
  return notes;
}

}  // namespace trestle::describe
