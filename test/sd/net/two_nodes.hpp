#pragma once
#include <gmock/gmock.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <string>
#include <vector>

#include "sd/net/node.hpp"
#include "test/loopback.hpp"

namespace trestle::test {

inline const IpAddress server_address = own_address(1);
inline const IpAddress client_address = own_address(2);
inline const IpAddress other_address = own_address(3);

/// Timing so quick that a test is, but for what expires: a machine that stalls makes nobody go.
inline sd::NodeConfig quick(const IpAddress& address) {
  using namespace std::chrono_literals;
  return {.address = address,
          .multicast = own_group(),
          .timing = {.initial_delay_min = 0ms,
                     .initial_delay_max = 5ms,
                     .repetitions_base_delay = 5ms,
                     .cyclic_offer_delay = 50ms,
                     .request_response_delay_max = 1ms,
                     .ttl_s = 600}};
}

/// As quick(), but an offer is multicast once, and later sent when asked for. A client that has two multicast
/// offers before an answer, as where the machine stalls between them, subscribes anew, and by that gets
/// initial events once more.
inline sd::NodeConfig calm(const IpAddress& address) {
  using namespace std::chrono_literals;
  sd::NodeConfig config = quick(address);
  config.timing.initial_delay_max = 0ms;
  config.timing.repetitions_max = 0;
  config.timing.cyclic_offer_delay = 1h;
  return config;
}

inline std::vector<std::byte> numbers(std::size_t bytes, std::size_t seed = 0) {
  std::vector<std::byte> result(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    result[i] = static_cast<std::byte>((i + seed) * 131 >> 3U);
  }
  return result;
}

/// A message that was received, with its payload.
struct Received {
  someip::Header header;
  std::vector<std::byte> payload;
  Endpoint from;
};

/// The outcome of a call.
struct Outcome {
  std::optional<sd::CallFault> fault;
  someip::ReturnCode code{};
  std::vector<std::byte> payload;
};

/// Nodes on loopback, and what they received.
class TwoNodes : public testing::Test {
 protected:
  template <typename Condition>
  [[nodiscard]] bool run_until(Condition condition,
                               std::chrono::milliseconds limit = std::chrono::seconds{60}) {
    using Clock = std::chrono::steady_clock;
    constexpr Clock::duration step = std::chrono::milliseconds{5};
    // Time in which the machine stalls does not count: what came meanwhile is still to be worked off.
    for (Clock::duration left = limit; left > Clock::duration{0};) {
      if (condition()) {  // asked once: it may do something
        return true;
      }
      const Clock::time_point before = Clock::now();
      io.run_one_for(std::min(left, step));
      left -= std::min(Clock::now() - before, step);
    }
    return condition();
  }
  /// Also works off what has come by then, however slow the machine is.
  void run_for(std::chrono::milliseconds time) {
    static_cast<void>(run_until([] { return false; }, time));
    io.poll();
  }
  sd::EventHandler collect() {
    return [this](const someip::Message& message, const Endpoint& from) {
      events.push_back({message.header, {message.payload.begin(), message.payload.end()}, from});
    };
  }
  sd::ResponseHandler note() {
    return [this](const sd::CallResult& result) {
      if (result) {
        outcomes.push_back(
            {{}, result->header.return_code, {result->payload.begin(), result->payload.end()}});
      } else {
        const ByteView payload = result.error().payload;
        outcomes.push_back({result.error().fault, result.error().code, {payload.begin(), payload.end()}});
      }
    };
  }
  static sd::DiscoveryLog into(std::vector<std::string>& log) {
    return [&log](const std::string& line) { log.push_back(line); };
  }

  boost::asio::io_context io;
  std::vector<Received> events;
  std::vector<Outcome> outcomes;
  std::vector<std::string> server_log;
  std::vector<std::string> client_log;
};

}  // namespace trestle::test
