// bridge/describe/read/vsomeip: the JSON configurations of vsomeip, of all its releases.
// docs/describe.md tells what is read.
//
//   read_vsomeip.hpp    start here: files become a model
//   json_tree.hpp       a parser of JSON that keeps the place of each value, and takes comments
//   vsomeip_reader.hpp  the reader; services.cpp has its part for services and their events
#pragma once
#include <span>
#include <string_view>

#include "bridge/describe/model.hpp"
#include "bridge/describe/read/source_text.hpp"

namespace trestle::describe {

/// Whether a JSON text has something of a vsomeip configuration in it: "services", "unicast", "applications"
/// … It need not be good. An object without members counts as one.
[[nodiscard]] bool is_vsomeip(std::string_view text);

/// Reads configurations of vsomeip, all releases of it: services, instances, events, eventgroups, endpoints,
/// SD settings, TP, nPDU, E2E. Several files are parts of one configuration, as in vsomeip's folders.
///
/// Such files have ids and no names: things are called "service_1234", "event_8001", "field_8002",
/// "method_0001", and what their payloads are made of is not known, so these are empty. What does not tell
/// about interfaces (logging, routing, security) is left out without a word.
///
/// @param max_bytes  larger files are refused.
/// @return problems: at most 100 a file, with places.
[[nodiscard]] Reading read_vsomeip(std::span<const SourceText> sources,
                                   std::size_t max_bytes = std::size_t{16} << 20U);

}  // namespace trestle::describe
