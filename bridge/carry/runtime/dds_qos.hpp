#pragma once
#include "bridge/carry/config/bridge_config.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::carry {

/// The quality of service of a route's reader or writer.
[[nodiscard]] inline dds::Qos dds_qos(const QosSettings& settings) {
  return {.reliable = settings.reliable,
          .transient_local = settings.transient_local,
          .depth = settings.depth,
          .keep_all = settings.keep_all,
          .deadline = settings.deadline,
          .lifespan = settings.lifespan,
          .manual_liveliness = settings.manual_liveliness,
          .liveliness_lease = settings.liveliness_lease};
}

}  // namespace trestle::carry
