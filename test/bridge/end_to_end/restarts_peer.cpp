// A neighbour of bridges that restarts_test.py kills and starts again: of one bridge that is killed, too, and
// of one that is not.
//
//     restarts_peer ros DOMAIN               publishes /up_N, reads /down_N
//     restarts_peer someip ADDRESS GROUP     subscribes to service 0x1000 + N, offers service 0x2000 + N
//
// N is 0 and 1. Each sends "PID" every 20 ms, and prints a line "up N PID" or "down N PID" for each that it
// gets: who reads them knows that what arrives is of the living. Ends with SIGTERM.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <functional>
#include <string>
#include <vector>

#include "dds_adapter/participant.hpp"
#include "dds_adapter/ros_names.hpp"
#include "sd/net/handles.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::test {
namespace {

using namespace std::chrono_literals;

// A line that the pipe does not take is left out.
void print(const std::string& line) {
  if (write(STDOUT_FILENO, line.data(), line.size()) < 0 && errno == EPIPE) {
    std::_Exit(1);
  }
}

// "00001234", so that it has always the same length: as std_msgs/msg/String, in CDR and in a SOME/IP payload.
std::string name() {
  return fmt::format("{:08}", getpid());
}
std::vector<std::byte> with_front(const std::vector<int>& front) {
  std::vector<std::byte> bytes;
  for (const int one : front) {
    bytes.push_back(static_cast<std::byte>(one));
  }
  for (const char one : name()) {
    bytes.push_back(static_cast<std::byte>(one));
  }
  bytes.push_back(std::byte{0});
  return bytes;
}
std::string text_at(std::size_t place, ByteView bytes) {
  std::string text;
  for (std::size_t i = place; i < std::min(bytes.size(), place + 8); ++i) {
    text += static_cast<char>(bytes[i]);
  }
  return text;
}

// Calls `send` every 20 ms until SIGTERM.
void run(boost::asio::io_context& io, const std::function<void()>& send) {
  boost::asio::signal_set signals{io, SIGTERM};
  signals.async_wait([&](auto, int) { io.stop(); });
  boost::asio::steady_timer timer{io};
  const std::function<void()> again = [&] {
    send();
    timer.expires_after(20ms);
    timer.async_wait([&](const boost::system::error_code& error) { error ? void() : again(); });
  };
  again();
  io.run();
}

void ros(std::uint32_t domain) {
  dds::Participant participant{{.domain = domain,
                                .name = "restarts",
                                .interfaces = {"127.0.0.1"},
                                .shared_memory = false,
                                .lease = 1s,
                                .on_event = {}}};
  const std::string type = dds::ros_type_name("std_msgs/msg/String");
  std::vector<dds::Writer> writers;
  std::vector<dds::Reader> readers;
  for (const int n : {0, 1}) {
    writers.push_back(participant.create_writer(fmt::format("rt/up_{}", n), type, {}));
    readers.push_back(participant.create_reader(
        fmt::format("rt/down_{}", n), type, {},
        [n](const dds::Sample& sample) { print(fmt::format("down {} {}\n", n, text_at(8, sample.cdr()))); }));
  }
  const std::vector<std::byte> sample = with_front({0, 1, 0, 0, 9, 0, 0, 0});
  boost::asio::io_context io{1};
  run(io, [&] {
    for (dds::Writer& writer : writers) {
      static_cast<void>(writer.write(sample));
    }
  });
}

void someip(const IpAddress& address, const IpAddress& group) {
  boost::asio::io_context io{1};
  sd::Node node{io,
                {.address = address,
                 .multicast = group,
                 .timing = {.initial_delay_min = Duration{0},
                            .initial_delay_max = 10ms,
                            .repetitions_base_delay = 20ms,
                            .cyclic_offer_delay = 200ms,
                            .ttl_s = 1}}};
  constexpr someip::MethodId event{0x8001};
  constexpr someip::EventgroupId eventgroup{1};
  std::vector<sd::OfferHandle> offers;
  for (const std::uint16_t n : {std::uint16_t{0}, std::uint16_t{1}}) {
    node.subscribe({.service = someip::ServiceId(0x1000U + n), .eventgroup = eventgroup, .events = {event}},
                   [n](const someip::Message& message, const Endpoint&) {
                     print(fmt::format("up {} {}\n", n, text_at(7, message.payload)));
                   });
    offers.push_back(node.offer({.service = someip::ServiceId(0x2000U + n),
                                 .instance = someip::InstanceId{1},
                                 .eventgroups = {{.id = eventgroup, .events = {event}}}}));
  }
  const std::vector<std::byte> payload = with_front({0, 0, 0, 12, 0xef, 0xbb, 0xbf});
  run(io, [&] {
    const ByteView bytes{payload};
    for (const sd::OfferHandle offer : offers) {
      node.notify(offer, event, {&bytes, 1});
    }
  });
  node.shutdown();
}

}  // namespace
}  // namespace trestle::test

int main(int count, char** words) {
  const std::vector<std::string> arguments(words, words + count);
  fcntl(STDOUT_FILENO, F_SETFL, fcntl(STDOUT_FILENO, F_GETFL) | O_NONBLOCK);
  if (arguments.size() == 3 && arguments[1] == "ros") {
    trestle::test::ros(static_cast<std::uint32_t>(std::stoul(arguments[2])));
    return 0;
  }
  if (arguments.size() == 4 && arguments[1] == "someip") {
    trestle::test::someip(*trestle::someip::parse_address(arguments[2]),
                          *trestle::someip::parse_address(arguments[3]));
    return 0;
  }
  return 2;
}
