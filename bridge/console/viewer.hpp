#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/console/foxglove.hpp"

namespace trestle::console {

/// What one viewer may have of us.
struct ViewerLimits {
  std::size_t subscriptions = 2048;
  std::size_t queued_bytes = std::size_t{64} << 20U;  ///< of messages that wait until it reads
  std::size_t queued_messages = 10'000;
  std::size_t queued_texts = 100;  ///< of the protocol; with more it is given up
  /// Likewise, of those behind the first one: what there is to be told of all channels may be long.
  std::size_t queued_text_bytes = std::size_t{16} << 20U;
};

/// The bytes of a message, shared by all viewers.
using MessageBytes = std::shared_ptr<const std::vector<std::byte>>;

/// Why messages are not sent to a viewer.
enum class ViewerLoss : std::uint8_t {
  slow,        ///< it reads too slowly: the oldest gave way
  too_large,   ///< more than Onlooker copies, or than may wait
  unreadable,  ///< cannot be put into the form of the channel
};

/// A client of Foxglove's protocol: what it has subscribed to, and what waits to be sent to it. Without a
/// socket, a clock or a thread.
class Viewer {
 public:
  /// What is to be sent as one WebSocket message: the head, then the bytes, if there are any.
  struct Frame {
    bool is_text = false;
    std::string head;
    MessageBytes bytes;
  };

  /// @param greeting  the first text.
  explicit Viewer(std::string greeting, ViewerLimits limits = {});

  /// Channels that there are from now on, and that there are no longer.
  void offer(std::span<const foxglove::Channel> channels);
  void withdraw(std::span<const std::uint32_t> channels);

  /// @return nothing; or why this is no client of the protocol.
  [[nodiscard]] tl::expected<void, std::string> on_text(std::string_view text);
  [[nodiscard]] tl::expected<void, std::string> on_bytes(std::string_view bytes);

  [[nodiscard]] bool wants(std::uint32_t channel) const { return by_channel_.contains(channel); }
  /// All that it has subscribed to.
  [[nodiscard]] std::vector<std::uint32_t> wanted() const;
  /// A message of a channel, if it wants that. The oldest give way where too much waits.
  void add(std::uint32_t channel, std::int64_t at_ns, const MessageBytes& bytes);
  /// Messages that it does not get, though it wants the channel. It is told of the 1st, 10th, 100th and so
  /// on: Lichtblick shows each text that differs as a problem of its own.
  /// @param why  of ViewerLoss::unreadable.
  void lose(std::uint32_t channel, ViewerLoss reason, std::uint64_t count = 1, const std::string& why = {});

  /// What is sent next: texts first. Nothing waits: nothing.
  [[nodiscard]] std::optional<Frame> next();
  /// It does not even read what we say of ourselves. From then on nothing more waits for it.
  [[nodiscard]] bool is_lost() const noexcept { return is_lost_; }
  /// It wants nothing any more, and nothing waits for it.
  void give_up();

  [[nodiscard]] std::size_t queued_bytes() const noexcept { return queued_bytes_; }
  /// By ViewerLoss.
  [[nodiscard]] const std::array<std::uint64_t, 3>& lost() const noexcept { return lost_; }
  /// Messages that next() has given.
  [[nodiscard]] std::uint64_t sent() const noexcept { return sent_; }

 private:
  struct Message {
    std::uint32_t subscription = 0;
    std::uint32_t channel = 0;
    std::int64_t at_ns = 0;
    MessageBytes bytes;
  };
  void fulfil(const foxglove::Wish& wish);
  [[nodiscard]] std::string fault_of(const foxglove::Subscribe::One& one) const;
  void end(std::uint32_t subscription);
  void drop_oldest();
  void push(std::string text);
  void tell(foxglove::Level level, const std::string& text, const std::string& id);

  ViewerLimits limits_;
  std::deque<std::string> texts_;
  std::size_t text_bytes_ = 0;
  bool is_lost_ = false;
  std::deque<Message> messages_;
  std::size_t queued_bytes_ = 0;
  std::map<std::uint32_t, std::string> topics_;        ///< of channels that it knows
  std::map<std::uint32_t, std::uint32_t> channels_;    ///< by subscription
  std::map<std::uint32_t, std::uint32_t> by_channel_;  ///< and the other way round
  std::array<std::uint64_t, 3> lost_{};
  std::uint64_t sent_ = 0;
};

}  // namespace trestle::console
