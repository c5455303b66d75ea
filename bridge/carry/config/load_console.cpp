#include "bridge/carry/config/load_console.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "bridge/documents/section.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

std::optional<Endpoint> read_address(std::string_view text) {
  const bool bracketed = text.starts_with('[');
  const bool bare_v6 = !bracketed && std::ranges::count(text, ':') > 1;
  const std::size_t end = bracketed ? text.find(']')
                          : bare_v6 ? text.size()
                                    : std::min(text.find(':'), text.size());
  if (end == std::string_view::npos || text.find('\0') != std::string_view::npos) {
    return std::nullopt;
  }
  // Also the unspecified one: all addresses of this host.
  const std::string host{bracketed ? text.substr(1, end - 1) : text.substr(0, end)};
  const auto address = someip::parse_address(host);
  if (!address || address->is_multicast() || address->v6 != (bracketed || bare_v6)) {
    return std::nullopt;
  }
  Endpoint result{*address, ConsoleSettings::default_port};
  if (const std::string_view rest = text.substr(bracketed ? end + 1 : end); !rest.empty()) {
    const auto port =
        rest.starts_with(':') ? documents::whole_number(1, 65535).read(rest.substr(1)) : std::nullopt;
    if (!port) {
      return std::nullopt;
    }
    result.port = static_cast<std::uint16_t>(*port);
  }
  return result;
}

}  // namespace

documents::Format<Endpoint> console_address() {
  return {"an address of this host and a port, as in 127.0.0.1:9464 or [::1]:9464", read_address};
}

std::string fault_of(const ConsoleSettings& console) {
  return console.token_file.empty() && !console.at.address.is_loopback()
             ? fmt::format("{} is reached from other hosts: `token_file` is needed",
                           someip::to_string(console.at.address))
             : std::string{};
}

void load_console(const YAML::Node& node, const std::string& file, ConsoleSettings& into,
                  documents::Problems& problems) {
  documents::Section console{node, "console", problems};
  console.read("address", console_address(), into.at);
  std::string token_file;
  if (console.read("token_file", documents::any_text("a file with the token that is to be asked for"),
                   token_file)) {
    into.token_file = (std::filesystem::path{file}.parent_path() / token_file).lexically_normal().string();
  }
  into.mark = console.value_mark("address");
  console.finish();
  if (const std::string fault = fault_of(into); !fault.empty()) {
    problems.error(into.mark, "address: " + fault);
  }
}

}  // namespace trestle::carry
