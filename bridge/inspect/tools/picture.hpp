#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "bridge/cli/terminal.hpp"
#include "bridge/inspect/tools/sighting_text.hpp"
#include "bridge/inspect/tools/watcher.hpp"

/// What `trestle watch` shows of a network as a whole. docs/tools.md documents the JSON.
namespace trestle::inspect {

struct Picture {
  const Watcher& seen;
  std::string where;  ///< for the title: the interface, or the file
  TimePoint since{};
  TimePoint now{};
  bool live = false;                            ///< rates are those of the last seconds, not of all the time
  bool traffic = true;                          ///< frames are seen, not only what discovery sends to all
  std::uint64_t dropped = 0;                    ///< frames that came too fast
  const describe::Interfaces* names = nullptr;  ///< null: everything is shown by its ids
};

/// The whole screen, with the escape sequences that put it over the one before.
[[nodiscard]] std::string screen_of(const Picture& picture, cli::TerminalSize size,
                                    const cli::Colours& colours);
/// The same tables in full, for a file.
[[nodiscard]] std::string text_of(const Picture& picture, const cli::Colours& colours);
/// The same in one object.
[[nodiscard]] std::string json_of(const Picture& picture);

/// A row of traffic, as a line.
[[nodiscard]] std::string describe(const SeenTraffic& row, const InstanceNames& names, const Rate& rate);
/// The same in JSON, added to an object.
void add_traffic(nlohmann::ordered_json& object, const SeenTraffic& row, const InstanceNames& names,
                 const Rate& rate);

}  // namespace trestle::inspect
