#include "someip/net/tcp_places.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace trestle::someip {

std::optional<TcpPlace> who_gives_way(const std::vector<TcpPlace>& places, std::size_t own,
                                      const std::function<bool(const TcpPlace&)>& in_use) {
  std::map<IpAddress, std::size_t> counts;
  for (const TcpPlace& place : places) {
    ++counts[place.client.address];
  }
  const auto most = std::ranges::max_element(counts, {}, [](const auto& one) { return one.second; });
  const bool by_address = most != counts.end() && own + 1 < most->second;
  std::vector<const TcpPlace*> candidates;
  for (const TcpPlace& place : places) {
    if (by_address ? place.client.address == most->first
                   : place.unread || (place.silent && (!place.spoke || counts[place.client.address] > own))) {
      candidates.push_back(&place);
    }
  }
  std::ranges::sort(candidates, {}, [](const TcpPlace* one) {
    return std::tuple{!one->unread, one->spoke, one->last, one->client, one->own};
  });
  const auto found = std::ranges::find_if(
      candidates, [&](const TcpPlace* one) { return one->unread || !in_use || !in_use(*one); });
  if (found != candidates.end()) {
    return **found;
  }
  return by_address ? std::optional{*candidates.back()} : std::nullopt;
}

}  // namespace trestle::someip
