#include "bridge/documents/document.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>

#include "bridge/documents/format.hpp"

namespace trestle::documents {
namespace {

/// Walks over a file to find where documents begin.
class DocumentStarts : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { last = to_mark(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnAlias(const YAML::Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnScalar(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& /*value*/) override {}
  void OnSequenceStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                       YAML::EmitterStyle::value /*style*/) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  YAML::EmitterStyle::value /*style*/) override {}
  void OnMapEnd() override {}

  Mark last;
};

/// The last opened bracket that is never closed; nothing if there is none.
std::optional<std::pair<char, Mark>> open_bracket(std::string_view text) {
  std::vector<std::pair<char, Mark>> open;
  Mark here{.line = 1, .column = 1};
  char quote = 0;      // the quote that a quoted text began with
  char before = '\n';  // the character before an opening quote or a comment
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      if (quote == '"' && c == '\\' && i + 1 < text.size()) {
        ++i;
        ++here.column;
      } else if (c == quote) {
        quote = 0;
      }
    } else if ((c == '"' || c == '\'') &&
               std::string_view{" \t\n[{,:"}.find(before) != std::string_view::npos) {
      quote = c;
    } else if (c == '#' && (before == ' ' || before == '\t' || before == '\n')) {
      i = std::min(text.find('\n', i), text.size()) - 1;
      continue;
    } else if (c == '{' || c == '[') {
      open.emplace_back(c, here);
    } else if ((c == '}' || c == ']') && !open.empty()) {
      open.pop_back();
    }
    before = c;
    here = c == '\n' ? Mark{.line = here.line + 1, .column = 1}
                     : Mark{.line = here.line, .column = here.column + 1};
  }
  return open.empty() ? std::nullopt : std::optional{open.back()};
}

}  // namespace

void tell_of_bad_yaml(const YAML::Exception& error, std::string_view text, Problems& problems) {
  const std::string_view why = error.msg;
  if (why.find("flow not found") != std::string_view::npos ||
      why.find("illegal block entry") != std::string_view::npos) {
    if (const auto bracket = open_bracket(text)) {
      problems.error(bracket->second, fmt::format("not valid YAML: this '{}' is not closed; expected '{}'",
                                                  bracket->first, bracket->first == '{' ? '}' : ']'));
      return;
    }
  }
  problems.error(to_mark(error.mark), "not valid YAML: " + printable(error.msg));
}

tl::expected<std::string, std::string> read_text_file(const std::string& file, std::size_t bytes_max) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return tl::unexpected<std::string>{"cannot be read: it is a folder"};
  }
  errno = 0;
  std::ifstream in{file, std::ios::binary};
  if (!in) {
    return tl::unexpected{"cannot be read: " + std::generic_category().message(errno)};
  }
  std::string text;
  while (in && text.size() <= bytes_max) {
    constexpr std::size_t least = 4096;
    const std::size_t begin = text.size();
    const std::size_t more = std::min(bytes_max - begin + 1, std::max(begin, least));
    text.resize(begin + more);
    in.read(text.data() + begin, static_cast<std::streamsize>(more));
    text.resize(begin + static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad()) {
    return tl::unexpected<std::string>{"cannot be read to its end"};
  }
  return text;
}

YAML::Node parse_document(const std::string& text, const std::string& expected, Problems& problems) {
  if (text.size() > document_bytes_max) {
    problems.error(Mark{}, fmt::format("the file is larger than {}", bytes_to_string(document_bytes_max)));
    return YAML::Node{YAML::NodeType::Undefined};
  }
  try {
    // Not YAML::LoadAll: with too many brackets at the end it finds documents without end.
    std::istringstream stream{text};
    YAML::Parser parser{stream};
    DocumentStarts documents;
    YAML::Node node;
    if (parser.HandleNextDocument(documents)) {
      if (parser.HandleNextDocument(documents)) {
        problems.error(documents.last, "the file should end here: it is one YAML document");
        return YAML::Node{YAML::NodeType::Undefined};
      }
      node = YAML::Load(text);
    }
    if (!node.IsNull()) {
      return node;
    }
    problems.error(Mark{1, 1}, "the file is empty: expected " + expected);
  } catch (const YAML::Exception& error) {
    tell_of_bad_yaml(error, text, problems);
  }
  return YAML::Node{YAML::NodeType::Undefined};
}

}  // namespace trestle::documents
