#include "test/bench/newcomer.hpp"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdio>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <vector>

#include "sd/net/handles.hpp"
#include "sd/net/proxy.hpp"

namespace trestle::newcomer {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr someip::ServiceId echo_service{0x7e5d};
constexpr someip::MethodId echo{1};
constexpr someip::ServiceId event_service{0x7e5c};
constexpr someip::EventgroupId eventgroup{1};
constexpr someip::MethodId event{0x8001};
constexpr std::size_t event_bytes = 64;
constexpr auto warm_up = 100ms;

/// Nearest rank.
std::int64_t percentile(const std::vector<std::int64_t>& sorted, std::size_t percent) {
  return sorted.empty() ? 0 : sorted[(sorted.size() * percent + 99) / 100 - 1];
}

struct Figures {
  std::size_t bytes = 0;
  double seconds = 0;
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  std::vector<std::int64_t> latency_ns{};

  void print() {
    if (received == 0) {
      throw std::runtime_error{"nothing came"};
    }
    std::ranges::sort(latency_ns);
    const double rate = static_cast<double>(received) / seconds;
    std::printf(R"({"payload_bytes":%zu,"seconds":%.3f,"received":%llu,"lost":%llu,"per_second":%.1f,)"
                R"("megabytes_per_second":%.3f,"latency_ns":{"count":%zu,"p50":%lld,"p99":%lld}})"
                "\n",
                bytes, seconds, static_cast<unsigned long long>(received),
                static_cast<unsigned long long>(lost), rate, rate * static_cast<double>(bytes) / 1e6,
                latency_ns.size(), static_cast<long long>(percentile(latency_ns, 50)),
                static_cast<long long>(percentile(latency_ns, 99)));
  }
};

}  // namespace

void serve_echo(const sd::NodeConfig& config) {
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  const auto answer = [](const someip::Message& request, sd::Responder responder) {
    responder.respond(request.payload);
  };
  const sd::Offer offer{
      node, {.service = echo_service, .instance = someip::InstanceId{1}, .methods = {{echo, answer}}}};
  io.run();
}

void call_echo(const sd::NodeConfig& config, std::size_t bytes, double seconds) {
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  sd::Proxy proxy{node, {.service = echo_service}};
  const std::vector<std::byte> payload(bytes, std::byte{0x5a});
  Figures figures{.bytes = bytes, .seconds = seconds};
  Clock::time_point start = Clock::time_point::max();  // once the first answer has come
  std::function<void()> call = [&] {
    const auto called = Clock::now();
    proxy.call({.method = echo, .transport = Transport::udp}, payload,
               [&, called](const boost::system::error_code& error, const sd::Response& response) {
                 const auto now = Clock::now();
                 if (start == Clock::time_point::max()) {
                   if (error) {
                     throw boost::system::system_error{error};
                   }
                   start = now + warm_up;
                 } else if (called >= start && !error && response.payload.size() == bytes) {
                   figures.latency_ns.push_back(std::chrono::nanoseconds{now - called}.count());
                   ++figures.received;
                 } else if (called >= start) {
                   ++figures.lost;
                 }
                 if (now < start + std::chrono::duration<double>{seconds}) {
                   call();
                 } else {
                   io.stop();
                 }
               });
  };
  call();
  io.run();
  figures.print();
}

void serve_events(const sd::NodeConfig& config) {
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  const sd::Offer offer{node,
                        {.service = event_service,
                         .instance = someip::InstanceId{1},
                         .eventgroups = {{.id = eventgroup, .events = {event}}}}};
  std::vector<std::byte> payload(event_bytes);
  std::uint64_t number = 0;
  boost::asio::steady_timer timer{io};
  std::function<void()> turn = [&] {
    if (node.subscribers(offer.handle(), event) > 0) {
      ++number;
      std::memcpy(payload.data(), &number, sizeof number);
      offer.notify(event, payload);
      boost::asio::post(io, [&] { turn(); });
    } else {
      timer.expires_after(10ms);
      timer.async_wait([&](const boost::system::error_code& /*none*/) { turn(); });
    }
  };
  turn();
  io.run();
}

void count_events(const sd::NodeConfig& config, double seconds) {
  boost::asio::io_context io{1};
  sd::Node node{io, config};
  Figures figures{.bytes = event_bytes, .seconds = seconds};
  boost::asio::steady_timer timer{io};
  bool counts = false;
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  const auto after = [&](const auto& time, auto what) {
    timer.expires_after(std::chrono::duration_cast<Clock::duration>(time));
    timer.async_wait([what](const boost::system::error_code& error) {
      if (!error) {
        what();
      }
    });
  };
  const auto measure = [&] {
    counts = true;
    after(std::chrono::duration<double>{seconds}, [&] { io.stop(); });
  };
  const sd::Subscription subscription{node,
                                      {.service = event_service, .eventgroup = eventgroup, .events = {event}},
                                      [&](const someip::Message& message, const Endpoint& /*from*/) {
                                        const bool is_first = last == 0;
                                        std::memcpy(&last, message.payload.data(),
                                                    std::min(sizeof last, message.payload.size()));
                                        if (is_first) {
                                          after(warm_up, measure);
                                        } else if (counts) {
                                          first = first == 0 ? last : first;
                                          ++figures.received;
                                        }
                                      }};
  after(10s, [&] { io.stop(); });  // for the first one
  io.run();
  const std::uint64_t sent = figures.received > 0 ? last - first + 1 : 0;
  figures.lost = sent - std::min(sent, figures.received);
  figures.print();
  node.shutdown();  // so that the server stops
}

}  // namespace trestle::newcomer
