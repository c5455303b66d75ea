#include "bridge/carry/runtime/surroundings.hpp"

#include <algorithm>

#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

double seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>{time}.count();
}

const char* kind_of(Counter::Kind kind) {
  using Kind = Counter::Kind;
  switch (kind) {
    case Kind::traffic:
      return "traffic";
    case Kind::loss:
      return "loss";
    case Kind::doubt:
      return "doubt";
    case Kind::now:
      break;
  }
  return "now";
}

const char* name_of(Transport transport) {
  return transport == Transport::tcp ? "tcp" : "udp";
}

}  // namespace

QosPicture picture_of(const dds::Qos& qos) {
  return {.reliable = qos.reliable,
          .transient_local = qos.transient_local,
          .depth = qos.depth,
          .keep_all = qos.keep_all,
          .deadline_s = seconds(qos.deadline),
          .liveliness_s = seconds(qos.liveliness_lease),
          .manual_liveliness = qos.manual_liveliness};
}

WriterPicture picture_of(const dds::FoundWriter& writer) {
  QosPicture qos = picture_of(writer.qos);
  qos.depth = 0;  // discovery does not tell it
  return {.topic = dds::topic_of_ros(writer.topic).value_or(writer.topic),
          .type = dds::type_of_ros(writer.type).value_or(writer.type),
          .node = writer.node,
          .qos = qos,
          .bridge = writer.bridge,
          .refused = writer.refused};
}

OfferPicture picture_of(const sd::SeenOffer& offer) {
  return {value(offer.service), value(offer.instance), offer.major, offer.minor,
          someip::to_string(offer.host)};
}

std::vector<OfferPicture> pictures_of(std::span<const sd::SeenOffer> offers) {
  std::vector<OfferPicture> result;
  for (const sd::SeenOffer& one : offers.first(std::min(offers.size(), most_in_picture))) {
    result.push_back(picture_of(one));
  }
  return result;
}

std::vector<CounterPicture> pictures_of(const std::vector<Counter>& counters) {
  std::vector<CounterPicture> result;
  result.reserve(counters.size());
  for (const Counter& one : counters) {
    result.push_back({one.name, one.count, kind_of(one.kind)});
  }
  return result;
}

RoutePicture picture_of(const Route& route) {
  RoutePicture result;
  result.kind = route.direction == Direction::dds_to_someip ? "topic_to_event" : "event_to_topic";
  result.name = route.topic;
  result.direction = to_string(route.direction);
  result.type = route.type;
  result.service = value(route.service);
  result.instance = value(route.instance);
  result.member = value(route.event);
  result.eventgroup = value(route.eventgroup);
  result.major = route.major;
  result.minor = route.minor;
  result.transport = name_of(route.transport);
  result.line = static_cast<std::uint32_t>(std::max(0, route.mark.line));
  result.dds.qos = picture_of(route.qos);
  return result;
}

RoutePicture picture_of(const MethodRoute& method) {
  RoutePicture result;
  const bool calls = method.server == Server::someip;
  result.kind = calls ? "service_to_method" : "method_to_service";
  result.name = method.ros_service;
  result.direction = to_string(calls ? Direction::dds_to_someip : Direction::someip_to_dds);
  result.type = method.type;
  result.service = value(method.service);
  result.instance = value(method.instance);
  result.member = value(method.method);
  result.major = method.major;
  result.minor = method.minor;
  result.transport = method.transport ? name_of(*method.transport) : "";
  result.line = static_cast<std::uint32_t>(std::max(0, method.mark.line));
  result.limit = static_cast<std::uint32_t>(method.max_calls);
  return result;
}

RoutePicture picture_of(const TopicPattern& pattern) {
  RoutePicture result = picture_of(pattern.route);
  result.kind = "pattern";
  result.name = pattern.topics;
  result.line = static_cast<std::uint32_t>(std::max(0, pattern.mark.line));
  return result;
}

}  // namespace trestle::carry
