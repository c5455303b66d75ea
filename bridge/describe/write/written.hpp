// bridge/describe/write: writers of a model. Each makes the texts of one target of `trestle generate`.
//
//   written.hpp  what a writer returns: files, and what it could not carry
//   routes/      route files for `trestle bridge`
//   msg/         ROS 2 packages with .msg and .srv files
//   fidl/        FIDL and FDEPL
//   arxml/       ARXML of the Adaptive Platform
//   vsomeip/     vsomeip's JSON
//   wireshark/   a profile of Wireshark
//   sheet/       an interface sheet for people
//
// A writer opens no file. What its target cannot express it lists by name; it never leaves something out
// silently. A new target gets a folder here, and a line in bridge/generate/targets.cpp.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What a comment says of an id that no description gives.
inline constexpr std::string_view chosen_id_note = "chosen by Trestle, not given by a description";

/// A file that a writer made.
struct TextFile {
  std::string path;  ///< within the folder of the output: "msg/Door.msg"
  std::string text;
};

/// What a writer made of a model.
struct Written {
  std::vector<TextFile> files{};
  std::vector<NotCarried> not_carried{};
};

}  // namespace trestle::describe
