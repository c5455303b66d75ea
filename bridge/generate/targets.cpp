#include "bridge/generate/targets.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"
#include "bridge/describe/write/msg/write_msg.hpp"
#include "bridge/describe/write/sheet/write_sheet.hpp"
#include "bridge/describe/write/vsomeip/write_vsomeip.hpp"
#include "bridge/describe/write/wireshark/write_wireshark.hpp"

namespace trestle::generate {
namespace {

using describe::System;
using describe::Written;

/// Ordered as in the documents.
constexpr std::array all{
    Target{"routes", "Route file of `trestle bridge`",
           [](const System& system, const TargetOptions& options) {
             return describe::write_routes(system.model, system.lowered, options.routes);
           },
           true},
    Target{"msg", "ROS 2 packages with .msg and .srv files",
           [](const System& system, const TargetOptions&) {
             return describe::write_msg(system.model, system.lowered);
           },
           true},
    Target{"fidl", "FIDL and FDEPL of CommonAPI",
           [](const System& system, const TargetOptions&) { return describe::write_fidl(system.model); }},
    Target{"vsomeip", "Configurations of vsomeip",
           [](const System& system, const TargetOptions&) { return describe::write_vsomeip(system.model); }},
    Target{"arxml", "AUTOSAR Adaptive",
           [](const System& system, const TargetOptions&) {
             describe::ArxmlFile file = describe::write_arxml(system.model);
             return Written{.files = {{"interfaces.arxml", std::move(file.text)}},
                            .not_carried = std::move(file.not_carried)};
           }},
    Target{
        "wireshark", "Profile of Wireshark with its SOME/IP tables",
        [](const System& system, const TargetOptions&) { return describe::write_wireshark(system.model); }},
    Target{"sheet", "Interface sheet with the bytes of each payload: Markdown and HTML",
           [](const System& system, const TargetOptions&) { return describe::write_sheet(system.model); }},
    Target{"json", "The model itself",
           [](const System& system, const TargetOptions&) {
             return Written{.files = {{"model.json", describe::to_json_text(system.model)}}};
           }},
};

}  // namespace

std::span<const Target> targets() {
  return all;
}

const Target* target(std::string_view name) {
  const auto* found = std::ranges::find(all, name, &Target::name);
  return found == all.end() ? nullptr : found;
}

}  // namespace trestle::generate
