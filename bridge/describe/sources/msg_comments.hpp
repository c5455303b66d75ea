#pragma once
#include <string_view>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/messages/types/message_definition.hpp"

/// What people wrote beside the fields of a `.msg`, `.srv` or `.action` file.
namespace trestle::describe {

/// The comments of a file's fields: those on the lines directly above a field, and the one behind it. A
/// comment "unit: km/h" is the unit. Marks of ours and lines without a letter or digit are none.
class MsgComments {
 public:
  /// @param text  of the file; not copied.
  explicit MsgComments(std::string_view text);

  /// Of a field that was parsed from the same text.
  [[nodiscard]] Notes of(const messages::Field& field) const;

 private:
  std::vector<std::string_view> lines_;
};

}  // namespace trestle::describe
