// bridge/describe/write/vsomeip: configurations of vsomeip 3.
//
//   write_vsomeip.hpp  the whole writer: a file for the application that offers the provided instances, and
//                      one for the application that uses them
//
// The keys are those that bridge/describe/read/vsomeip reads; a test reads back what is written.
#pragma once
#include <cstdint>
#include <string>

#include "bridge/describe/model.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe {

/// For whom a configuration of vsomeip is.
struct VsomeipOptions {
  /// The application that takes part; it also does the routing.
  std::string application = "trestle";
  std::uint16_t client_id = 0x1000;
  /// The host's address; nothing: that of the machine, or of the first provided instance.
  std::optional<IpAddress> address{};
};

/// Writes two configurations of vsomeip 3: "vsomeip-service.json" for an application that offers the provided
/// instances of the model, "vsomeip-client.json" for one that uses them, each for a host of its own. What
/// payloads are made of and names are not in such files; they are not told as not carried.
[[nodiscard]] Written write_vsomeip(const Model& model, const VsomeipOptions& options = {});

}  // namespace trestle::describe
