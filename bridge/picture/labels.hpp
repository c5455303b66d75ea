#pragma once
#include <string>
#include <vector>

#include "bridge/picture/picture.hpp"

namespace trestle::carry {

/// What numbers are about, for programs that must not take a name apart.
struct Label {
  const char* name;  ///< "topic", "direction", "service" and the like
  std::string value;
};
using Labels = std::vector<Label>;

/// Of the counters of a route: `topic` or `ros_service`, `direction`, `service`, `instance`, and `event` or
/// `method`.
[[nodiscard]] Labels labels_of(const RoutePicture& route);
/// Of the metrics of a route: `route`, `kind`, `direction`, `service`, `instance`.
[[nodiscard]] Labels metric_labels_of(const RoutePicture& route);

}  // namespace trestle::carry
