#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// Adds a comment's lines to what is there: "unit: km/h" is the unit. Lines without a letter or digit and
/// marks of ours say nothing.
/// @param lines  without comment signs; each is trimmed.
void add_comment(Comment& to, std::string_view lines);

/// What "unit: none" says: there is no unit, also where brackets look like one.
inline constexpr std::string_view no_unit = "none";

/// Takes the only "[m/s]" of a complete comment out of its text, and as the unit, as rosidl does. What has a
/// comma is a range, and no unit. Where a line says "unit:", brackets are text.
void take_unit(Comment& comment);

/// The lines by which add_comment() and take_unit() read `text` and `unit` again, without comment signs.
[[nodiscard]] std::string comment_lines(std::string_view text, std::string_view unit);

/// What people wrote in a `.msg`, `.srv` or `.action` file, line by line:
///  - on the lines directly above a field or constant, and behind it,
///    with the lines below it that are further in
///    than it is;
///  - before the first of them, with an empty line between: of the message. As for rosidl, what begins on the
///    first line of a `.msg` file is always that.
/// Licences and marks of ours are left out.
class MsgComments {
 public:
  /// @param is_msg  the file is one message.
  explicit MsgComments(bool is_msg) : is_msg_{is_msg} {}

  /// Takes the next line of the file.
  /// @param line  after it was parsed into `part`.
  void add_line(std::string_view line, MessageDefinition& part);
  /// The part has ended. The next line is of another one, if there is one.
  void end_part(MessageDefinition& part);

 private:
  void end_block(MessageDefinition& part);

  bool is_msg_;
  bool at_top_ = true;                     ///< no line was there that is no comment
  bool block_at_top_ = false;              ///< block_ began on the first line
  std::vector<std::string_view> block_{};  ///< the comments directly above, with their '#'
  std::size_t fields_ = 0;                 ///< of the part, so far
  std::size_t constants_ = 0;
  Comment* last_ = nullptr;  ///< of what was declared last, while lines below it may be about it
  std::size_t indentation_ = 0;
};

}  // namespace trestle::messages
