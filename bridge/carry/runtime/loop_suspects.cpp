#include "bridge/carry/runtime/loop_suspects.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/documents/problems.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t participant_bytes = 12;  // of a GUID

bool has_sorted(const std::vector<IpAddress>& all, const IpAddress& one) noexcept {
  return std::ranges::binary_search(all, one);
}

void sort_once(std::vector<IpAddress>& all) {
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
}

}  // namespace

dds::OnMatch LoopSuspects::on_match() const {
  return [changes = changes_](const dds::Guid& /*peer*/, bool /*matched*/) { ++*changes; };
}

dds::ServiceConfig LoopSuspects::watching(dds::ServiceConfig ros) const {
  ros.on_request_match = on_match();
  return ros;
}

void LoopSuspects::look(const DdsSide& dds) {
  seen_ = *changes_;  // before it looks: who comes meanwhile is looked at again
  const std::vector<dds::Counterpart> found = dds.counterparts(topic_, writers_);
  set(found, found.empty() ? std::vector<IpAddress>{} : someip::own_addresses());
}

void LoopSuspects::set(const std::vector<dds::Counterpart>& found, std::vector<IpAddress> own) {
  own_ = std::move(own);
  sort_once(own_);
  all_.clear();
  hosts_.clear();
  any_here_ = false;
  last_host_ = {};
  is_last_ = false;
  for (const dds::Counterpart& one : found) {
    all_.push_back(suspect(one));
    any_here_ = any_here_ || all_.back().here;
    hosts_.insert(hosts_.end(), all_.back().addresses.begin(), all_.back().addresses.end());
  }
  sort_once(hosts_);
  std::ranges::sort(all_, {}, &Suspect::endpoint);
}

LoopSuspects::Suspect LoopSuspects::suspect(const dds::Counterpart& found) const {
  Suspect result{.endpoint = found.guid};
  for (const std::string& text : found.addresses) {
    if (const auto address = someip::parse_address(text)) {
      result.here = result.here || is_here(*address);
      result.addresses.push_back(*address);
    }
  }
  sort_once(result.addresses);
  return result;
}

bool LoopSuspects::is_here(const IpAddress& host) const noexcept {
  return host.is_loopback() || has_sorted(own_, host);
}

bool LoopSuspects::has(const Suspect& one, const IpAddress& host) const noexcept {
  return (one.here && is_here(host)) || has_sorted(one.addresses, host);
}

bool LoopSuspects::find(const IpAddress& host) const noexcept {
  return (any_here_ && is_here(host)) || has_sorted(hosts_, host);
}

bool LoopSuspects::is_at(const dds::Guid& endpoint, std::span<const IpAddress> hosts) const noexcept {
  dds::Guid first{};
  std::copy_n(endpoint.begin(), participant_bytes, first.begin());
  const auto found = std::ranges::lower_bound(all_, first, {}, &Suspect::endpoint);
  return found != all_.end() &&
         std::equal(first.begin(), first.begin() + participant_bytes, found->endpoint.begin()) &&
         std::ranges::any_of(hosts, [&](const IpAddress& host) { return has(*found, host); });
}

std::string LoopSuspects::name_at(const IpAddress& host, const DdsSide& dds) const {
  const std::vector<dds::Counterpart> found = dds.counterparts(topic_, writers_);
  if (found.empty()) {
    return "somebody who has left";
  }
  const auto there =
      std::ranges::find_if(found, [&](const dds::Counterpart& one) { return has(suspect(one), host); });
  const dds::Counterpart& named = there != found.end() ? *there : found.front();
  if (!named.node.empty()) {
    return "the ROS node " + documents::printable(named.node);
  }
  std::string guid;
  for (const std::byte byte : std::span{named.guid}.first(participant_bytes)) {
    guid += fmt::format("{:02x}", std::to_integer<unsigned>(byte));
  }
  return fmt::format("the DDS participant {} ({})", documents::quote(named.participant), guid);
}

}  // namespace trestle::carry
