#include "dds_adapter/bridge_ends.hpp"

#include <algorithm>

#include "dds_adapter/participant_core.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::dds::detail {

namespace {

constexpr std::string_view key = "trestle";

}  // namespace

std::string with_bridge_entry(const std::string& user_data, const std::string& bridge) {
  if (bridge.empty()) {
    return user_data;
  }
  const bool is_plain = std::ranges::all_of(bridge, [](char c) { return c > ' ' && c <= '~' && c != ';'; });
  if (!is_plain || bridge.size() > max_bridge_text) {
    throw DdsError{"'" + bridge + "' cannot stand in the user data of a bridge's reader or writer"};
  }
  return user_data + std::string{key} + "=" + bridge + ";";
}

std::optional<std::string> bridge_entry(std::string_view user_data) {
  const std::string_view text = user_data_value(user_data, key).substr(0, max_bridge_text);
  return text.empty() ? std::nullopt : std::optional{std::string{text}};
}

void FoundBridgeEnds::note(const fast::FoundEndpoint& endpoint) {
  const auto text = endpoint.there ? bridge_entry(endpoint.user_data) : std::nullopt;
  const std::lock_guard lock{mutex_};
  const auto known = ends_.find(endpoint.guid);
  if (!text) {
    if (known != ends_.end() && !endpoint.there) {
      ends_.erase(known);
      ++changes_;
    }
    return;
  }
  if (known != ends_.end() ? known->second.text == *text : ends_.size() >= max_ends) {
    return;
  }
  ends_.insert_or_assign(endpoint.guid, End{endpoint.topic, *text, endpoint.writer});
  ++changes_;
}

bool FoundBridgeEnds::contains(const fast::Guid& guid) const {
  const std::lock_guard lock{mutex_};
  return ends_.contains(guid);
}

std::optional<std::string> FoundBridgeEnds::text_of(const fast::Guid& guid) const {
  const std::lock_guard lock{mutex_};
  const auto known = ends_.find(guid);
  return known == ends_.end() ? std::nullopt : std::optional{known->second.text};
}

OtherEnd judge(const FoundBridgeEnds& ends, const fast::Guid& peer, const TakesBridge& takes) {
  const auto text = ends.text_of(peer);
  return !text ? OtherEnd::none : takes && takes(*text) ? OtherEnd::taken : OtherEnd::ignored;
}

std::vector<BridgeEnd> FoundBridgeEnds::of_topic(std::string_view topic) const {
  std::vector<BridgeEnd> result;
  const std::lock_guard lock{mutex_};
  for (const auto& [guid, end] : ends_) {
    if (topic.empty() || end.topic == topic) {
      result.push_back({end.text, end.writer, to_guid(guid)});
    }
  }
  return result;
}

bool IgnoredMatches::change(const fast::Guid& peer, bool matched, bool ignored) {
  ignored = ignored && matched;
  const std::lock_guard lock{mutex_};
  const bool known = ignored ? !peers_.insert(peer).second : peers_.erase(peer) != 0;
  count_ = peers_.size();
  return ignored || (known && !matched);
}

}  // namespace trestle::dds::detail
