#include "bridge/console/foxglove.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

namespace trestle::console::foxglove {
namespace {

using nlohmann::json;

// Names in texts are those of configurations and of types: what is no UTF-8 there must not throw here.
std::string text_of(const json& message) {
  return message.dump(-1, ' ', false, json::error_handler_t::replace);
}

tl::unexpected<std::string> wrong(const char* what) {
  return tl::unexpected<std::string>{what};
}

void append(std::string& to, std::uint64_t number, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) {
    to += static_cast<char>(number >> (8 * i) & 0xffU);
  }
}

std::optional<std::uint32_t> id_of(const json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max()) {
    return std::nullopt;
  }
  return value.get<std::uint32_t>();
}

std::optional<std::uint32_t> id_at(const json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? std::nullopt : id_of(*found);
}

tl::expected<Wish, std::string> read_subscribe(const json& message) {
  const auto list = message.find("subscriptions");
  if (list == message.end() || !list->is_array()) {
    return wrong("subscribe has no array `subscriptions`");
  }
  Subscribe result;
  for (const json& one : *list) {
    const auto id = one.is_object() ? id_at(one, "id") : std::nullopt;
    const auto channel = one.is_object() ? id_at(one, "channelId") : std::nullopt;
    if (!id || !channel) {
      return wrong("subscribe: expected {\"id\": NUMBER, \"channelId\": NUMBER}");
    }
    result.subscriptions.push_back({*id, *channel});
  }
  return result;
}

tl::expected<Wish, std::string> read_unsubscribe(const json& message) {
  const auto list = message.find("subscriptionIds");
  if (list == message.end() || !list->is_array()) {
    return wrong("unsubscribe has no array `subscriptionIds`");
  }
  Unsubscribe result;
  for (const json& one : *list) {
    const auto id = id_of(one);
    if (!id) {
      return wrong("unsubscribe: expected numbers");
    }
    result.ids.push_back(*id);
  }
  return result;
}

}  // namespace

std::string_view chosen_of(std::string_view offered) noexcept {
  while (!offered.empty()) {
    std::string_view one = offered.substr(0, offered.find(','));
    offered.remove_prefix(std::min(offered.size(), one.size() + 1));
    one.remove_prefix(std::min(one.size(), one.find_first_not_of(" \t")));
    one = one.substr(0, one.find_last_not_of(" \t") + 1);
    if (const auto found = std::ranges::find(subprotocols, one); found != subprotocols.end()) {
      return *found;
    }
  }
  return {};
}

std::string server_info(const std::string& name, const std::string& session) {
  return text_of({{"op", "serverInfo"},
                  {"name", name},
                  {"capabilities", json::array()},
                  {"supportedEncodings", json::array()},
                  {"metadata", json::object()},
                  {"sessionId", session}});
}

std::string advertise(std::span<const Channel> channels) {
  json message{{"op", "advertise"}, {"channels", json::array()}};
  for (const Channel& one : channels) {
    message["channels"].push_back({{"id", one.id},
                                   {"topic", one.topic},
                                   {"encoding", one.encoding},
                                   {"schemaName", one.schema_name},
                                   {"schema", one.schema},
                                   {"schemaEncoding", one.schema_encoding}});
  }
  return text_of(message);
}

std::string unadvertise(std::span<const std::uint32_t> channels) {
  return text_of({{"op", "unadvertise"}, {"channelIds", channels}});
}

std::string status(Level level, const std::string& message, const std::string& id) {
  return text_of({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}, {"id", id}});
}

std::string message_head(std::uint32_t subscription, std::int64_t at_ns) {
  std::string head{'\x01'};
  append(head, subscription, 4);
  append(head, static_cast<std::uint64_t>(at_ns), 8);
  return head;
}

tl::expected<Wish, std::string> read_text(std::string_view text) {
  const json message = json::parse(text, nullptr, false);
  if (!message.is_object()) {
    return wrong("this is no JSON object");
  }
  const auto found = message.find("op");
  if (found == message.end() || !found->is_string()) {
    return wrong("this has no text `op`");
  }
  const auto& what = found->get_ref<const std::string&>();
  if (what == "subscribe") {
    return read_subscribe(message);
  }
  if (what == "unsubscribe") {
    return read_unsubscribe(message);
  }
  constexpr std::size_t longest = 40;
  return NotOffered{what.substr(0, longest)};
}

tl::expected<Wish, std::string> read_bytes(std::string_view bytes) {
  if (bytes.starts_with('\x01')) {
    return NotOffered{"publishing of messages"};
  }
  if (bytes.starts_with('\x02')) {
    return NotOffered{"calls of services"};
  }
  return wrong("these bytes begin with no opcode of the protocol");
}

}  // namespace trestle::console::foxglove
