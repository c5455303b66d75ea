#pragma once
#include <string>

#include "bridge/console/viewer_counters.hpp"
#include "bridge/picture/picture.hpp"

namespace trestle::console {

/// How metrics are written.
enum class MetricsForm : std::uint8_t {
  prometheus,   ///< the text format 0.0.4
  openmetrics,  ///< OpenMetrics 1.0
};

/// The type of the form, for HTTP.
[[nodiscard]] const char* content_type(MetricsForm form) noexcept;

/// The picture as metrics: docs/status.md lists them. What tells things apart is in labels (route, peer,
/// reason), never in names.
[[nodiscard]] std::string metrics(const carry::Picture& picture, MetricsForm form,
                                  const ViewerCounters& viewers = {});

}  // namespace trestle::console
