#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <variant>
#include <vector>

/// The messages of the Foxglove WebSocket protocol, version 1, as far as a server needs them that only shows.
/// https://github.com/foxglove/ws-protocol had its specification (docs/spec.md, until 2025).
namespace trestle::console::foxglove {

/// The protocol's name in the handshake, and its older name: nothing else differs.
inline constexpr std::array<std::string_view, 2> subprotocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// Which of those that a client offers is taken: its first one that is ours; empty: none.
/// @param offered  the header Sec-WebSocket-Protocol.
[[nodiscard]] std::string_view chosen_of(std::string_view offered) noexcept;

/// Messages of one kind, under one name.
struct Channel {
  std::uint32_t id = 0;  ///< never that of another
  std::string topic;
  std::string encoding;     ///< of messages: "cdr", "json"
  std::string schema_name;  ///< "sensor_msgs/msg/PointCloud2"
  std::string schema_encoding;
  std::string schema;
};

enum class Level : std::uint8_t { info, warning, error };

/// Says what this is, before anything else.
/// @param session  another one for each start: then a client forgets what it knows of channels.
[[nodiscard]] std::string server_info(const std::string& name, const std::string& session);
[[nodiscard]] std::string advertise(std::span<const Channel> channels);
[[nodiscard]] std::string unadvertise(std::span<const std::uint32_t> channels);
/// @param id  a later message with the same one takes the place of this one.
[[nodiscard]] std::string status(Level level, const std::string& message, const std::string& id);

/// What stands before a message: 0x01, the subscription and the time.
inline constexpr std::size_t message_head_bytes = 13;
[[nodiscard]] std::string message_head(std::uint32_t subscription, std::int64_t at_ns);

/// What a client asks for.
struct Subscribe {
  struct One {
    std::uint32_t id = 0;  ///< chosen by the client
    std::uint32_t channel = 0;
    friend bool operator==(const One&, const One&) = default;
  };
  std::vector<One> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids;
};
/// Something that we have not said we can do.
struct NotOffered {
  std::string what;  ///< its name in the protocol, or what came, cut
};
using Wish = std::variant<Subscribe, Unsubscribe, NotOffered>;

/// Reads a text of a client. @return or what is wrong with it.
[[nodiscard]] tl::expected<Wish, std::string> read_text(std::string_view text);
/// The same of bytes.
[[nodiscard]] tl::expected<Wish, std::string> read_bytes(std::string_view bytes);

}  // namespace trestle::console::foxglove
