#include "bridge/picture/labels.hpp"

#include <fmt/format.h>

#include <utility>

namespace trestle::carry {
namespace {

std::string hex(std::uint16_t id) {
  return fmt::format("{:#06x}", id);
}

/// Between which networks, and by which service.
Labels with_service(Labels labels, const RoutePicture& route) {
  labels.push_back({"direction", route.direction});
  labels.push_back({"service", hex(route.service)});
  labels.push_back({"instance", hex(route.instance)});
  return labels;
}

}  // namespace

Labels labels_of(const RoutePicture& route) {
  const bool is_method = route.kind == "service_to_method" || route.kind == "method_to_service";
  const bool is_event = route.kind == "topic_to_event" || route.kind == "event_to_topic";
  Labels labels = with_service({{is_method ? "ros_service" : "topic", route.name}}, route);
  labels.push_back({is_event ? "event" : "method", hex(route.member)});
  return labels;
}

Labels metric_labels_of(const RoutePicture& route) {
  return with_service({{"route", route.name}, {"kind", route.kind}}, route);
}

}  // namespace trestle::carry
