#pragma once

namespace CLI {
class App;
}

namespace trestle::inspect {

/// Adds `trestle decode`. Its exit status is 0, or 1 when anything was malformed, or 2 when the command line
/// is wrong or the capture cannot be opened.
void add_decode_command(CLI::App& app, int& status);

}  // namespace trestle::inspect
