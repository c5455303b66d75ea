#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "dds_adapter/service.hpp"
#include "test/bytes.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::test {

/// The service of these tests, test_msgs/srv/Add: int64 a, int64 b, and int64 sum.
inline dds::ServiceConfig add_service() {
  dds::ServiceConfig config;
  config.name = "/add";
  config.type = "test_msgs/srv/Add";
  config.match_timeout = patience;
  return config;
}

/// Numbers as a little-endian message of nothing else.
inline std::vector<std::byte> numbers(std::initializer_list<std::int64_t> values) {
  std::vector<std::byte> bytes = hex("00010000");
  for (const std::int64_t value : values) {
    for (unsigned shift = 0; shift < 64; shift += 8) {
      bytes.push_back(static_cast<std::byte>(static_cast<std::uint64_t>(value) >> shift));
    }
  }
  return bytes;
}

/// The number at a place among them.
inline std::int64_t number_at(std::span<const std::byte> message, std::size_t index) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    value |= std::to_integer<std::uint64_t>(message[4 + 8 * index + i]) << 8 * i;
  }
  return static_cast<std::int64_t>(value);
}

/// What a call came to: a sum or a fault.
using Sum = tl::expected<std::int64_t, dds::CallFault>;

/// Works clients and servers from one thread, as their owner has to.
class ServiceDriver {
 public:
  dds::ServiceClient& client(dds::Participant& participant,
                             const dds::ServiceConfig& config = add_service()) {
    clients_.push_back(std::make_unique<dds::ServiceClient>(participant, config, [] {}));
    return *clients_.back();
  }

  /// One that answers with the sum at once.
  dds::ServiceServer& adder(dds::Participant& participant, const dds::ServiceConfig& config = add_service()) {
    const auto index = servers_.size();
    return server(participant, config,
                  [this, index](const dds::RequestId& id, const dds::ServiceMessage& request) {
                    const auto sum = numbers({number_at(request.cdr(), 0) + number_at(request.cdr(), 1)});
                    const dds::ByteView bytes = sum;
                    servers_[index]->reply(id, {&bytes, 1}, std::chrono::steady_clock::now());
                  });
  }
  dds::ServiceServer& server(dds::Participant& participant, const dds::ServiceConfig& config,
                             dds::ServiceServer::Handler handler) {
    servers_.push_back(std::make_unique<dds::ServiceServer>(
        participant, config, [] {}, std::move(handler)));
    return *servers_.back();
  }
  void end_servers() { servers_.clear(); }

  static void add(dds::ServiceClient& client, std::int64_t a, std::int64_t b, std::vector<Sum>& into,
                  std::chrono::nanoseconds timeout = patience) {
    const auto request = numbers({a, b});
    const dds::ByteView bytes = request;
    client.call(
        {&bytes, 1}, timeout, std::chrono::steady_clock::now(),
        [&into](const tl::expected<dds::ServiceMessage, dds::CallFault>& reply) {
          into.push_back(reply ? Sum{number_at(reply->cdr(), 0)} : Sum{tl::unexpected{reply.error()}});
        });
  }

  void work() {
    const auto now = std::chrono::steady_clock::now();
    for (const auto& client : clients_) {
      client->work(now);
    }
    for (const auto& server : servers_) {
      server->work(now);
    }
  }
  template <typename Condition>
  bool until(Condition condition) {
    return eventually([&] {
      work();
      return condition();
    });
  }

 private:
  std::vector<std::unique_ptr<dds::ServiceClient>> clients_;
  std::vector<std::unique_ptr<dds::ServiceServer>> servers_;
};

}  // namespace trestle::test
