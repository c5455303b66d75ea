// bridge/describe/sources: descriptions of any kind, each read by the reader of its kind, as one model.
//
//   sources.hpp    loads files and folders, tells their kind by name and text, and merges what readers made
//   generated_list.hpp  what `trestle generate` wrote to a folder
//   kept_ids.hpp   reads ids.lock beside them: the ids that none of them gives
//   ros_types.hpp  makes services of ROS types: .msg, .srv, .action and .idl files, and names of types
//
// Captures, running networks and route files are sources of `trestle generate`, too: bridge/generate has
// them.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/describe/read/source_text.hpp"

namespace trestle::describe {

/// Which reader reads a file. `model` is what `--to json` writes, which none reads.
enum class SourceKind : std::uint8_t { fidl, arxml, vsomeip, ros, model, unknown };

/// By the end of the name; of JSON, and where the name says nothing, by the text. JSON without a text counts
/// as vsomeip's, and so does what is broken.
[[nodiscard]] SourceKind kind_of(std::string_view name, std::string_view text);

struct SourceOptions {
  /// Event ids below 0x8000 of an Adaptive ARXML get bit 15, with a note: see docs/describe_arxml.md.
  bool set_event_bit = true;
  std::vector<std::string> type_folders{};  ///< where packages of ROS types are, besides those of the files
  bool look_beside = true;  ///< for packages beside those of `.msg` files; else nothing is opened for these
};

/// Reads all sources, those of one kind together, and joins what they say (join.hpp). What is not UTF-8 is
/// made it, with a warning for each file; ARXML says itself how it is encoded.
/// @param load  asked for imports.
[[nodiscard]] Reading read_sources(std::span<const SourceText> sources, const Load& load,
                                   const SourceOptions& options = {});

/// Where a route file has its types from.
struct TypeOrigins {
  std::vector<std::string> folders{};     ///< with packages of ROS types: `types: paths`
  std::vector<std::string> interfaces{};  ///< descriptions that define types: `interfaces`
};

/// Larger files are refused; readers may have smaller limits.
struct SourceLimits {
  std::size_t file_bytes = std::size_t{256} << 20U;
  std::size_t all_bytes = std::size_t{512} << 20U;  ///< of all files together
};

/// Loads files; of folders all files in them, and below, whose names end like sources. Left out, with a
/// warning, is what `trestle generate` wrote there, and JSON that is not vsomeip's.
/// @return their texts, sorted by name within a folder; what cannot be read is a problem.
[[nodiscard]] std::vector<SourceText> load_sources(const std::vector<std::string>& paths,
                                                   std::vector<documents::Problem>& problems,
                                                   const SourceLimits& limits = {});

/// Whether it is a file of ROS types, or a folder with such a file in it or below.
[[nodiscard]] bool has_ros_files(const std::string& path);

/// Loads what a file names: for read_sources().
[[nodiscard]] Load file_loader();

}  // namespace trestle::describe
