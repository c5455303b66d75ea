#include "bridge/messages/types/type_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <tuple>

#include "bridge/documents/utf8.hpp"
#include "bridge/messages/types/builtin.hpp"
#include "bridge/messages/types/parsers.hpp"

namespace trestle::messages {
namespace {

namespace fs = std::filesystem;

tl::expected<std::string, TypeError> read_file(const fs::path& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  std::ifstream in{path, std::ios::binary};
  if (error || !in) {
    return tl::unexpected{TypeError{path.string(), 0, 0, "cannot be read"}};
  }
  if (size > max_msg_file_bytes) {
    return tl::unexpected{
        TypeError{path.string(), 0, 0, fmt::format("larger than {} bytes", max_msg_file_bytes)}};
  }
  std::ostringstream stream;
  stream << in.rdbuf();
  std::string text = stream.str();
  // Without a warning: encoding_warnings() makes it for callers that can tell it.
  std::ignore = documents::make_utf8(text);
  return text;
}

}  // namespace

fs::path FolderSource::file_of(const InterfaceName& interface) const {
  for (const std::string_view extension : {to_string(interface.kind), std::string_view{"idl"}}) {
    const std::string file = fmt::format("{}.{}", interface.full(), extension);
    for (const fs::path& path : {folder_ / file, folder_ / "share" / file}) {
      std::error_code error;
      if (fs::is_regular_file(path, error)) {
        return path;
      }
    }
  }
  return {};
}

tl::expected<std::optional<InterfaceMessages>, TypeError> FolderSource::find(
    const InterfaceName& interface) const {
  const fs::path path = file_of(interface);
  if (path.empty()) {
    return std::nullopt;
  }
  const auto text = read_file(path);
  if (!text) {
    return tl::unexpected{text.error()};
  }
  return path.extension() == ".idl" ? parse_idl(*text, interface, path.string())
                                    : parse_interface(*text, interface, path.string());
}

tl::expected<std::optional<InterfaceMessages>, TypeError> BuiltinSource::find(
    const InterfaceName& interface) const {
  const std::string name = interface.full();
  const auto all = builtin_definitions();
  const auto same = std::ranges::lower_bound(all, name, {}, &BuiltinDefinition::name);
  if (same == all.end() || same->name != name) {
    return std::nullopt;
  }
  return parse_interface(same->text, interface,
                         "built-in " + name + "." + std::string{to_string(interface.kind)});
}

tl::expected<std::optional<InterfaceMessages>, TypeError> MadeSource::find(
    const InterfaceName& interface) const {
  const std::string name = interface.full();
  const auto made = texts_.find(name);
  if (made == texts_.end()) {
    return std::nullopt;
  }
  return parse_interface(made->second, interface,
                         "made " + name + "." + std::string{to_string(interface.kind)});
}

}  // namespace trestle::messages
