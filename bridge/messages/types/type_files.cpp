#include "bridge/messages/types/type_files.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "bridge/documents/document.hpp"
#include "bridge/documents/utf8.hpp"

namespace trestle::messages {

std::vector<documents::Problem> encoding_warnings(const TypeTree& tree, std::set<std::string>& told) {
  constexpr std::array endings{".msg", ".srv", ".action", ".idl"};
  std::vector<documents::Problem> warnings;
  for (const MessageDefinition& message : tree.messages) {
    const bool is_of_ros =
        std::ranges::any_of(endings, [&](const char* ending) { return message.file.ends_with(ending); });
    std::error_code error;
    if (!is_of_ros || !told.insert(message.file).second ||
        !std::filesystem::is_regular_file(message.file, error)) {
      continue;  // of the program itself: "built-in std_msgs/msg/Header.msg"
    }
    if (auto text = documents::read_text_file(message.file)) {
      if (auto warning = documents::make_utf8(*text, message.file)) {
        warnings.push_back(std::move(*warning));
      }
    }
  }
  return warnings;
}

}  // namespace trestle::messages
