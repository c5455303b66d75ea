#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trestle::carry {

/// A copy of a message, for somebody who looks at a route.
struct SeenMessage {
  bool is_cdr = false;           ///< a CDR sample with its encapsulation header; else a SOME/IP payload
  std::vector<std::byte> bytes;  ///< empty where it is too large to be copied
  std::size_t size = 0;
  std::int64_t at_ns = 0;  ///< when it came, since 1970
};

/// Gets each message of a route on the thread that carries it, which it must not keep waiting.
using MessageSink = std::function<void(const std::shared_ptr<const SeenMessage>&)>;

/// A route whose messages can be followed.
struct RouteTitle {
  std::uint64_t id = 0;  ///< of this route alone, as long as the bridge runs
  std::string topic;
  std::string type;
  std::uint16_t service = 0;
  std::uint16_t instance = 0;
  std::uint16_t event = 0;
  friend bool operator==(const RouteTitle&, const RouteTitle&) = default;
};

}  // namespace trestle::carry
