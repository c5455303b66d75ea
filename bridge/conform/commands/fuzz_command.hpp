#pragma once
#include "bridge/generate/source_options.hpp"

namespace trestle::conform {

/// Adds `trestle fuzz`. Exit status: 0 when nothing was found, 1 when something was or the device could not
/// be fuzzed, 2 when the command line or the profile is wrong.
void add_fuzz_command(CLI::App& app, int& status, const generate::SourceReaders& readers);

}  // namespace trestle::conform
