#include "bridge/documents/ids_in_line.hpp"

#include <regex>

namespace trestle::documents {

std::string with_ids_replaced(const std::string& line,
                              const std::function<std::string(const IdsInLine&)>& words) {
  static const std::regex place{
      R"((eventgroup 0x([0-9a-f]{4}))?( of )?\b0x([0-9a-f]{4})\.(0x[0-9a-f]{4}|\*))"};
  std::string text;
  auto rest = line.cbegin();
  std::smatch found;
  while (std::regex_search(rest, line.cend(), found, place)) {
    const auto id = [&](std::size_t group) {
      return static_cast<std::uint16_t>(std::stoul(found[group], nullptr, 16));
    };
    text.append(rest, found[0].first);
    text += words({.eventgroup_text = found[1],
                   .eventgroup = found[1].matched ? std::optional{id(2)} : std::nullopt,
                   .between = found[3],
                   .service_text = "0x" + found[4].str(),
                   .service = id(4),
                   .instance_text = found[5]});
    rest = found[0].second;
  }
  return text.append(rest, line.cend());
}

}  // namespace trestle::documents
