#include "bridge/messages/types/msg_comments.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "bridge/messages/types/characters.hpp"
#include "bridge/messages/types/parsers.hpp"

namespace trestle::messages {
namespace {

/// Lines of dashes and the like say nothing. Bytes of other alphabets do.
bool says_something(std::string_view text) {
  return std::ranges::any_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           (static_cast<unsigned char>(c) & 0x80U) != 0;
  });
}

/// "m/s" of each "[m/s]" in a comment, as rosidl finds them.
std::vector<std::string_view> bracketed(std::string_view text) {
  std::vector<std::string_view> all;
  for (std::size_t open = text.find('['); open != std::string_view::npos; open = text.find('[', open)) {
    const std::size_t end = text.find_first_of(",]\n", ++open);
    if (end != std::string_view::npos && text[end] == ']' && end > open) {
      all.push_back(text.substr(open, end - open));
      open = end;
    }
  }
  return all;
}

std::string_view without_signs(std::string_view comment) {
  comment.remove_prefix(std::min(comment.find_first_not_of('#'), comment.size()));
  return trimmed(comment);
}

bool is_licence(const std::vector<std::string_view>& block) {
  constexpr std::array<std::string_view, 3> begins{"Copyright", "(c)", "SPDX-"};
  const auto first = std::ranges::find_if(block, says_something);
  return first != block.end() && std::ranges::any_of(begins, [&](std::string_view begin) {
           return without_signs(*first).starts_with(begin);
         });
}

}  // namespace

void add_comment(Comment& to, std::string_view lines) {
  constexpr std::string_view unit = "unit:";
  constexpr std::string_view mark = mark_comment.substr(2);  // without "# "
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find_first_of("\r\n"), lines.size());
    const std::string_view line = trimmed(lines.substr(0, end));
    lines.remove_prefix(std::min(end + 1, lines.size()));
    const bool is_unit =
        bracketed(line).size() == 1 && line.starts_with('[') && line.ends_with(']');  // "[%]"
    if ((!says_something(line) && !is_unit) || line.starts_with(mark)) {
      continue;
    }
    if (line.starts_with(unit)) {
      to.unit = trimmed(line.substr(unit.size()));
      continue;
    }
    to.text += to.text.empty() ? "" : "\n";
    to.text += line;
  }
}

void take_unit(Comment& comment) {
  if (comment.unit == no_unit) {
    comment.unit.clear();
    return;
  }
  const auto units = bracketed(comment.text);
  if (!comment.unit.empty() || units.size() != 1) {
    return;
  }
  std::string_view text = comment.text;
  const auto begin = static_cast<std::size_t>(units[0].data() - text.data()) - 1;
  const std::string_view behind = text.substr(begin + units[0].size() + 2);
  const std::size_t last = text.substr(0, begin).find_last_not_of(" \t\n");
  const std::string_view before = text.substr(0, last == std::string_view::npos ? 0 : last + 1);
  std::string rest = std::string{before} + std::string{before.empty() ? trimmed(behind, " \t\n") : behind};
  comment.unit = trimmed(units[0]);
  comment.text = says_something(rest) ? std::move(rest) : std::string{};
}

std::string comment_lines(std::string_view text, std::string_view unit) {
  const std::size_t brackets = bracketed(text).size();
  std::string lines{text};
  const auto add = [&](const std::string& line) { lines += (lines.empty() ? "" : "\n") + line; };
  const std::string in_brackets = "[" + std::string{unit} + "]";
  if (unit.empty()) {
    if (brackets == 1) {
      add("unit: " + std::string{no_unit});
    }
  } else if (brackets == 0 && bracketed(in_brackets).size() == 1 &&
             bracketed(in_brackets)[0].size() == unit.size()) {
    add(in_brackets);
  } else {
    add("unit: " + std::string{unit});
  }
  return lines;
}

void MsgComments::add_line(std::string_view line, MessageDefinition& part) {
  line = line.substr(0, line.find_last_not_of('\r') + 1);
  const std::string_view comment = trimmed(line.substr(comment_begin(line)));
  const std::size_t indentation = std::min(line.find_first_not_of(" \t"), line.size());
  const bool is_first = fields_ + constants_ == 0;
  const bool is_field = part.fields.size() > fields_;
  if (is_field || part.constants.size() > constants_) {
    if (is_first && is_msg_ && block_at_top_) {
      end_block(part);
    }
    fields_ = part.fields.size();
    constants_ = part.constants.size();
    last_ = is_field ? &part.fields.back().comment : &part.constants.back().comment;
    indentation_ = indentation;
    for (const std::string_view above : block_) {
      add_comment(*last_, without_signs(above));
    }
    block_.clear();
    add_comment(*last_, without_signs(comment));
  } else if (comment.empty()) {
    end_block(part);
    last_ = nullptr;
  } else if (last_ != nullptr && block_.empty() && indentation > indentation_) {
    add_comment(*last_, without_signs(comment));
  } else {
    block_at_top_ = block_.empty() ? at_top_ : block_at_top_;
    block_.push_back(comment);
  }
  at_top_ = false;
}

void MsgComments::end_block(MessageDefinition& part) {
  if (fields_ + constants_ == 0 && !is_licence(block_)) {
    for (const std::string_view above : block_) {
      add_comment(part.comment, without_signs(above));
    }
  }
  block_.clear();
}

void MsgComments::end_part(MessageDefinition& part) {
  end_block(part);
  fields_ = 0;
  constants_ = 0;
  last_ = nullptr;
}

}  // namespace trestle::messages
