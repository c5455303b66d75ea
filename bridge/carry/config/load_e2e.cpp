#include <fmt/format.h>

#include "bridge/carry/config/elements.hpp"
#include "bridge/describe/load_e2e.hpp"

namespace trestle::carry {

std::optional<E2eSettings> load_e2e(const YAML::Node& node, std::optional<Direction> known,
                                    documents::Problems& problems) {
  documents::Section section{node, "e2e", problems};
  const auto refused = [&](const char* key) {
    if (known == Direction::dds_to_someip) {
      problems.error(section.use_mark(key),
                     fmt::format("{}: is for routes with direction: someip_to_dds", key));
    }
  };
  return describe::load_e2e(section, false, refused, problems);
}

std::optional<E2eSettings> load_method_e2e(const YAML::Node& node, std::optional<Server> known,
                                           documents::Problems& problems) {
  documents::Section section{node, "e2e", problems};
  const auto refused = [&](const char* key) {
    if (known == Server::ros && std::string_view{key} == "source_id") {
      problems.error(
          section.use_mark(key),
          "source_id: identifies the caller, with server: someip; an answer has the id of its request");
    }
  };
  return describe::load_e2e(section, true, refused, problems);
}

void load_e2e_of_parts(documents::Section& section, std::optional<Server> known,
                       std::initializer_list<E2ePart> parts, documents::Problems& problems) {
  const YAML::Node node = section.child("e2e");
  if (!node) {
    return;
  }
  documents::Section of_parts{node, "e2e", problems};
  for (const E2ePart& part : parts) {
    const YAML::Node settings = of_parts.child(part.key);
    if (!settings) {
      continue;
    }
    std::optional<Direction> direction;
    if (known) {
      direction = *known == Server::ros ? Direction::dds_to_someip : Direction::someip_to_dds;
    }
    *part.into =
        part.is_event ? load_e2e(settings, direction, problems) : load_method_e2e(settings, known, problems);
  }
  of_parts.finish();
}

}  // namespace trestle::carry
