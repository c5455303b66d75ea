// Property: whatever texts and bytes a client of Foxglove's protocol sends, all that it is sent is JSON with
// a text `op`, or a message that it has subscribed to; what waits for it has its bounds; and its
// subscriptions are of channels that there are, each with one.
//
// Input: lines. One that begins with "b" is bytes, with "m" a message of the channel whose number follows,
// with "r" has it read one frame, with "w" withdraws a channel, with "o" offers it; all others are texts.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>

#include "bridge/console/viewer.hpp"

using namespace trestle;

namespace {

constexpr console::ViewerLimits limits{.subscriptions = 4,
                                       .queued_bytes = 100,
                                       .queued_messages = 5,
                                       .queued_texts = 8,
                                       .queued_text_bytes = 1000};

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

void read(console::Viewer& viewer) {
  const auto frame = viewer.next();
  if (frame && frame->is_text) {
    const auto message = nlohmann::json::parse(frame->head);
    require(message.is_object() && message["op"].is_string());
  } else if (frame) {
    require(frame->head.size() == console::foxglove::message_head_bytes && frame->bytes != nullptr);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest{reinterpret_cast<const char*>(data), size};
  console::Viewer viewer{R"({"op": "serverInfo"})", limits};
  std::set<std::uint32_t> offered;
  while (!rest.empty() && !viewer.is_lost()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const std::uint32_t number = line.size() < 2 ? 0 : static_cast<std::uint32_t>(line[1] & 7);
    bool goes_on = true;
    if (line.starts_with('m')) {
      viewer.add(number, 1, std::make_shared<const std::vector<std::byte>>(line.size()));
    } else if (line.starts_with('r')) {
      read(viewer);
    } else if (line.starts_with('w')) {
      offered.erase(number);
      viewer.withdraw(std::array{number});
    } else if (line.starts_with('o')) {
      offered.insert(number);
      viewer.offer(std::array{console::foxglove::Channel{.id = number, .topic = std::string{line}}});
    } else {
      goes_on = line.starts_with('b') ? viewer.on_bytes(line.substr(1)).has_value()
                                      : viewer.on_text(line).has_value();
    }
    const auto wanted = viewer.wanted();
    require(wanted.size() <= limits.subscriptions && viewer.queued_bytes() <= limits.queued_bytes);
    for (const std::uint32_t channel : wanted) {
      require(offered.contains(channel));
    }
    if (!goes_on) {
      break;
    }
  }
  while (const auto frame = viewer.next()) {
    require(frame->is_text == (frame->bytes == nullptr));
  }
  require(viewer.queued_bytes() == 0);
  return 0;
}
