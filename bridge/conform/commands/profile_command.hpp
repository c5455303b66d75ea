#pragma once
#include "bridge/generate/source_options.hpp"

namespace trestle::conform {

/// Adds `profile` to `trestle conform`: a first profile from a description, a capture or the network.
void add_profile_command(CLI::App& conform, int& status, const generate::SourceReaders& readers);

}  // namespace trestle::conform
