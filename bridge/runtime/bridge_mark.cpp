#include "bridge/runtime/bridge_mark.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "someip/net/address_text.hpp"

namespace trestle::bridge {
namespace {

// Takes what stands before `end`, or all if `end` is not there.
std::string_view next(std::string_view& text, char end) {
  const std::string_view part = text.substr(0, text.find(end));
  text.remove_prefix(std::min(part.size() + 1, text.size()));
  return part;
}

std::optional<std::uint16_t> number(std::string_view text) {
  std::uint16_t result = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), result, 16);
  return text.size() == 4 && error == std::errc{} && end == text.data() + text.size() ? std::optional{result}
                                                                                      : std::nullopt;
}

}  // namespace

std::string to_text(const BridgeMark& mark) {
  return fmt::format("{},{},{:04x}.{:04x}.{:04x}", mark.to_someip ? "out" : "in",
                     someip::to_string(mark.address), value(mark.service), value(mark.instance),
                     value(mark.id));
}

std::optional<BridgeMark> parse_bridge_mark(std::string_view text) {
  const std::string_view way = next(text, ',');
  const auto address = someip::parse_address(std::string{next(text, ',')});
  const auto service = number(next(text, '.'));
  const auto instance = number(next(text, '.'));
  const auto id = number(next(text, ','));  // behind it there may be more one day
  if ((way != "in" && way != "out") || !address || !service || !instance || !id) {
    return std::nullopt;
  }
  return BridgeMark{way == "out", *address, someip::ServiceId{*service}, someip::InstanceId{*instance},
                    someip::MethodId{*id}};
}

BridgeMark mark_of(const IpAddress& address, const Route& route) {
  return {route.direction == Direction::dds_to_someip, address, route.service, route.instance, route.event};
}

BridgeMark mark_of(const IpAddress& address, const MethodRoute& method) {
  return {method.server == Server::someip, address, method.service, method.instance, method.method};
}

bool Returns::update(const dds::Participant& participant) {
  const std::uint64_t changes = participant.bridge_changes();
  if (changes == seen_) {
    return false;
  }
  seen_ = changes;
  std::vector<IpAddress> addresses;
  for (const dds::BridgeEnd& end : participant.bridge_ends(topic_)) {
    const auto mark = parse_bridge_mark(end.text);
    if (mark && mark->to_someip != ours_.to_someip && mark->service == ours_.service &&
        mark->instance == ours_.instance && mark->id == ours_.id) {
      addresses.push_back(mark->address);
    }
  }
  std::ranges::sort(addresses);
  addresses.erase(std::unique(addresses.begin(), addresses.end()), addresses.end());
  return std::exchange(addresses_, addresses) != addresses;
}

bool Returns::has(const IpAddress& address) const {
  return !addresses_.empty() && std::ranges::binary_search(addresses_, address);
}

}  // namespace trestle::bridge
