#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "bridge/picture/seen_message.hpp"

namespace trestle::console {

/// Messages on their way from the thread of the bridge to that of its viewers. The bridge never waits: where
/// too much lies here, the oldest gives way.
class Inbox {
 public:
  struct Message {
    std::uint64_t route = 0;
    std::shared_ptr<const carry::SeenMessage> seen;
  };
  struct Content {
    std::deque<Message> messages;
    std::map<std::uint64_t, std::uint64_t> lost;  ///< by route
  };

  static constexpr std::size_t most_bytes = std::size_t{64} << 20U;
  static constexpr std::size_t most_messages = 10'000;

  /// @return whether it was empty: then somebody is to be told.
  [[nodiscard]] bool add(Message message) {
    std::vector<Message> dropped;  // whose memory is given back when nobody waits
    const std::lock_guard lock{mutex_};
    const bool was_empty = content_.messages.empty() && content_.lost.empty();
    bytes_ += message.seen->bytes.size();
    content_.messages.push_back(std::move(message));
    while (content_.messages.size() > 1 &&
           (bytes_ > most_bytes || content_.messages.size() > most_messages)) {
      Message& oldest = content_.messages.front();
      bytes_ -= oldest.seen->bytes.size();
      ++content_.lost[oldest.route];
      dropped.push_back(std::move(oldest));
      content_.messages.pop_front();
    }
    return was_empty;
  }

  [[nodiscard]] Content take() {
    Content taken;  // made before: the thread that takes gives way to others, and the bridge may wait for it
    const std::lock_guard lock{mutex_};
    bytes_ = 0;
    taken.messages.swap(content_.messages);
    taken.lost.swap(content_.lost);
    return taken;
  }

 private:
  std::mutex mutex_;
  Content content_;
  std::size_t bytes_ = 0;
};

}  // namespace trestle::console
