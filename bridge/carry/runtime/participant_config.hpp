#pragma once
#include "bridge/carry/config/bridge_config.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::carry {

/// How the bridge of a configuration joins its DDS domain, but for the callbacks.
[[nodiscard]] dds::ParticipantConfig participant_config(const DdsSettings& settings);

}  // namespace trestle::carry
