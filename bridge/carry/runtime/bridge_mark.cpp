#include "bridge/carry/runtime/bridge_mark.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "someip/net/address_text.hpp"

namespace trestle::carry {
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
  std::string text =
      fmt::format("{},{},{:04x}.{:04x}.{:04x}", mark.to_someip ? "out" : "in",
                  someip::to_string(mark.address), value(mark.service), value(mark.instance), value(mark.id));
  for (const IpAddress& one : mark.from) {
    text += (&one == mark.from.data() ? "," : "+") + someip::to_string(one);
  }
  return text;
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
  std::vector<IpAddress> from;
  for (std::string_view all = next(text, ','); !all.empty();) {
    if (const auto one = someip::parse_address(std::string{next(all, '+')})) {
      from.push_back(*one);
    }
  }
  return BridgeMark{
      way == "out",          *address,       someip::ServiceId{*service}, someip::InstanceId{*instance},
      someip::MethodId{*id}, std::move(from)};
}

BridgeMark mark_of(const IpAddress& address, const Route& route) {
  return {route.direction == Direction::dds_to_someip,
          address,
          route.service,
          route.instance,
          route.event,
          route.from_bridges};
}

BridgeMark mark_of(const IpAddress& address, const MethodRoute& method) {
  return {method.server == Server::someip,
          address,
          method.service,
          method.instance,
          method.method,
          method.from_bridges};
}

bool goes_on(const BridgeMark& ours, std::string_view theirs) {
  const auto mark = parse_bridge_mark(theirs);
  const auto has = [](const std::vector<IpAddress>& all, const IpAddress& one) {
    return std::ranges::find(all, one) != all.end();
  };
  return mark && (has(ours.from, mark->address) || has(mark->from, ours.address));
}

bool is_carried(const BridgeMark& ours, const dds::FoundWriter& writer) {
  return !writer.refused && (!writer.bridge || goes_on(ours, writer.bridge_text));
}

bool Returns::update(const DdsSide& dds) {
  const std::uint64_t changes = dds.bridge_changes();
  if (changes == seen_) {
    return false;
  }
  seen_ = changes;
  addresses_.clear();
  std::vector<IpAddress> unwanted;
  for (const dds::BridgeEnd& end : dds.bridge_ends(topic_)) {
    const auto mark = parse_bridge_mark(end.text);
    if (mark && mark->to_someip != ours_.to_someip && mark->service == ours_.service &&
        mark->instance == ours_.instance && mark->id == ours_.id) {
      addresses_.push_back(mark->address);
      if (!goes_on(ours_, end.text)) {
        unwanted.push_back(mark->address);
      }
    }
  }
  for (auto* all : {&addresses_, &unwanted}) {
    std::ranges::sort(*all);
    all->erase(std::unique(all->begin(), all->end()), all->end());
  }
  return std::exchange(unwanted_, unwanted) != unwanted;
}

bool Returns::has(const IpAddress& address) const {
  return !addresses_.empty() && std::ranges::binary_search(addresses_, address);
}

}  // namespace trestle::carry
