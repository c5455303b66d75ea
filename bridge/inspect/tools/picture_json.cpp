#include <cmath>

#include "bridge/inspect/tools/picture.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

using Json = nlohmann::ordered_json;

/// Three digits behind the point are enough for rates.
double rounded(double number) {
  return std::round(number * 1000) / 1000;
}

}  // namespace

void add_traffic(Json& object, const SeenTraffic& row, const InstanceNames& names, const Rate& rate) {
  object["service"] = sd::hexadecimal(value(row.service));
  if (const auto instance = names.instance_of(row)) {
    object["instance"] = sd::hexadecimal(value(*instance));
  }
  object[row.event ? "event" : "method"] = sd::hexadecimal(value(row.method));
  object["server"] = someip::to_string(row.server);
  object["transport"] = row.transport == Transport::tcp ? "tcp" : "udp";
  object["messages_per_second"] = rounded(rate.messages);
  object["bytes_per_second"] = rounded(rate.bytes);
  object["messages"] = row.messages;
  object["bytes"] = row.bytes;
  if (row.event) {
    object["lost"] = row.skipped;
    return;
  }
  object["answers"] = row.answers;
  object["errors"] = row.errors;
  if (const auto latency = row.median_latency()) {
    object["latency_p50_ns"] = latency->count();
  }
}

std::string json_of(const Picture& picture) {
  const NetworkView& network = picture.seen.network();
  Json object;
  object["seen"] = "summary";
  object["where"] = picture.where;
  object["time"] = time_text(picture.now);
  object["seconds"] = rounded(std::chrono::duration<double>{picture.now - picture.since}.count());
  Json& services = object["services"] = Json::array();
  for (const auto& [key, one] : network.services()) {
    Json& row = services.emplace_back();
    add_service(row, one);
    row["since"] = time_text(one.first_seen);
    row["gone"] = one.gone.has_value();
  }
  if (picture.traffic) {
    Json& subscriptions = object["subscriptions"] = Json::array();
    for (const auto& [key, one] : network.subscriptions()) {
      Json& row = subscriptions.emplace_back();
      add_subscription(row, one);
      row["state"] = to_string(one.state);
      row["since"] = time_text(one.first_seen);
      row["gone"] = one.gone.has_value();
    }
    const InstanceNames names{network};
    Json& traffic = object["traffic"] = Json::array();
    for (const auto& [key, one] : picture.seen.traffic().rows()) {
      add_traffic(traffic.emplace_back(), one, names, one.mean());
    }
  }
  Json& counters = object["counters"];
  counters["discovery_messages"] = network.counters().messages;
  counters["messages"] = picture.seen.traffic().counters().messages;
  counters["malformed"] = picture.seen.malformed();
  counters["not_kept"] = network.counters().not_kept + picture.seen.traffic().counters().not_kept;
  counters["frames_missed"] = picture.dropped;
  return object.dump();
}

}  // namespace trestle::inspect
