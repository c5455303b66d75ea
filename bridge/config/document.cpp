#include "bridge/config/document.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "bridge/config/format.hpp"

namespace trestle::bridge {
namespace {

// No hand-written configuration comes near; a file that does is not one.
constexpr std::size_t file_bytes_max = std::size_t{1} << 20U;

/// Walks over a file to see where documents begin.
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

}  // namespace

tl::expected<std::string, std::string> read_text_file(const std::string& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return tl::unexpected<std::string>{"cannot be read: it is a folder"};
  }
  errno = 0;
  std::ifstream in{file, std::ios::binary};
  if (!in) {
    return tl::unexpected{"cannot be read: " + std::generic_category().message(errno)};
  }
  // One byte more than allowed is enough to know: /dev/zero has no end.
  std::string text(file_bytes_max + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (in.bad()) {
    return tl::unexpected<std::string>{"cannot be read to its end"};
  }
  return text;
}

YAML::Node parse_document(const std::string& text, const std::string& expected, Problems& problems) {
  if (text.size() > file_bytes_max) {
    problems.error({}, fmt::format("the file is larger than {}", bytes_to_string(file_bytes_max)));
    return YAML::Node{YAML::NodeType::Undefined};
  }
  try {
    // Not YAML::LoadAll: on brackets too many at the end it finds documents without end.
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
    problems.error({.line = 1, .column = 1}, "the file is empty: expected " + expected);
  } catch (const YAML::Exception& error) {
    problems.error(to_mark(error.mark), "not valid YAML: " + printable(error.msg));
  }
  return YAML::Node{YAML::NodeType::Undefined};
}

}  // namespace trestle::bridge
