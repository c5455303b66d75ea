#pragma once
#include <string>

#include "dds_adapter/participant.hpp"

namespace trestle::carry {

/// What has happened in the DDS network, for the log: one line without a line end.
[[nodiscard]] std::string in_words(const dds::Happening& happening);

}  // namespace trestle::carry
