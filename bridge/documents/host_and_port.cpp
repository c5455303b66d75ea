#include "bridge/documents/host_and_port.hpp"

#include <algorithm>

#include "bridge/documents/format.hpp"

namespace trestle::documents {

std::optional<HostAndPort> host_and_port(std::string_view text) {
  const bool bracketed = text.starts_with('[');
  const bool bare_v6 = !bracketed && std::ranges::count(text, ':') > 1;
  const std::size_t end = bracketed ? text.find(']')
                          : bare_v6 ? text.size()
                                    : std::min(text.find(':'), text.size());
  if (end == std::string_view::npos) {
    return std::nullopt;
  }
  HostAndPort result{.host = bracketed ? text.substr(1, end - 1) : text.substr(0, end),
                     .v6 = bracketed || bare_v6};
  if (const std::string_view rest = text.substr(bracketed ? end + 1 : end); !rest.empty()) {
    const auto port = rest.starts_with(':') ? whole_number(1, 65535).read(rest.substr(1)) : std::nullopt;
    if (!port) {
      return std::nullopt;
    }
    result.port = static_cast<std::uint16_t>(*port);
  }
  return result;
}

}  // namespace trestle::documents
