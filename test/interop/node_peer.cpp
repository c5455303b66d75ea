// A Node that does what it is told on standard input, a command a line, and tells what happens on standard
// output: the other side of the tests with Python stacks. `peer.py` speaks with it.
#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/streambuf.hpp>
#include <cstdio>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>

#include "sd/net/node.hpp"
#include "someip/net/address_text.hpp"
#include "test/bytes.hpp"

namespace trestle::test {
namespace {

using namespace sd;
using namespace std::chrono_literals;
using someip::Message;
using someip::MethodId;

constexpr MethodId echo{0x0001};
constexpr MethodId forget{0x0002};
constexpr MethodId fail{0x0003};
constexpr MethodId many_bytes{0x0004};  // answers with as many bytes as the request's four say
constexpr MethodId getter{0x0010};
constexpr MethodId setter{0x0011};
constexpr MethodId notifier{0x8010};
constexpr MethodId udp_event{0x8001};
constexpr MethodId tcp_event{0x8002};
constexpr MethodId multicast_event{0x8004};

void tell(const std::string& line) {
  std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

std::uint16_t number(const std::string& text) {
  return static_cast<std::uint16_t>(std::stoul(text, nullptr, 0));
}

class Peer {
 public:
  Peer(boost::asio::io_context& io, const NodeConfig& config)
      : node_{io, config, [](const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); }},
        commands_{
            {"offer", [this](auto& words) { offer(words); }},
            {"withdraw", [this](auto&) { node_.withdraw(offer_); }},
            {"notify", [this](auto& words) { notify(words); }},
            {"set", [this](auto& words) { set(words); }},
            {"require", [this](auto& words) { require(words); }},
            {"call", [this](auto& words) { call(words); }},
            {"send", [this](auto& words) { send(words); }},
            {"subscribe", [this](auto& words) { subscribe(words); }},
            {"unsubscribe", [this](auto&) { node_.unsubscribe(subscription_); }},
            {"counters", [this](auto&) { counters(); }},
        } {}

  void obey(const std::string& line) {
    std::istringstream words{line};
    std::string command;
    words >> command;
    const auto found = commands_.find(command);
    if (found == commands_.end()) {
      tell("unknown command " + command);
      return;
    }
    found->second(words);
  }
  void shutdown() { node_.shutdown(); }

 private:
  using Words = std::istringstream;

  static std::string next(Words& words) {
    std::string word;
    words >> word;
    return word;
  }

  /// offer SERVICE INSTANCE udp|tcp|both [GROUP], which is the address of a multicast event
  void offer(Words& words) {
    ServiceSpec spec{.service = ServiceId{number(next(words))}, .instance = InstanceId{number(next(words))}};
    const std::string transports = next(words);
    const auto group = someip::parse_address(next(words));
    spec.udp_port = transports == "tcp" ? std::nullopt : std::optional{std::uint16_t{0}};
    spec.tcp_port = transports == "udp" ? std::nullopt : std::optional{std::uint16_t{0}};
    const auto told = [](const Message& request) {
      tell(fmt::format("request {:04x} {}", value(request.header.method), to_hex(request.payload)));
    };
    spec.methods = {{.id = echo,
                     .handler =
                         [told](const Message& request, Responder responder) {
                           told(request);
                           responder.respond(request.payload);
                         }},
                    {.id = forget,
                     .handler = [told](const Message& request, Responder /*responder*/) { told(request); },
                     .kind = someip::MethodKind::fire_and_forget},
                    {.id = fail,
                     .handler =
                         [told](const Message& request, Responder responder) {
                           told(request);
                           responder.error(someip::ReturnCode::not_ready);
                         }},
                    {.id = many_bytes, .handler = [](const Message& request, Responder responder) {
                       std::size_t size = 0;
                       for (const std::byte byte : request.payload) {
                         size = size << 8U | std::to_integer<std::size_t>(byte);
                       }
                       const std::vector<std::byte> bytes(size, std::byte{0x5a});
                       responder.respond(bytes);
                     }}};
    spec.fields = {{.getter = getter, .setter = setter, .notifier = notifier, .value = hex("01020304")}};
    spec.eventgroups = {{.id = EventgroupId{3}, .events = {notifier}}};
    if (spec.udp_port) {
      spec.eventgroups.push_back({.id = EventgroupId{1}, .events = {udp_event}});
    }
    if (spec.tcp_port) {
      spec.eventgroups.push_back({.id = EventgroupId{2}, .events = {tcp_event}});
      spec.tcp_events = {tcp_event};
    }
    if (group) {
      spec.eventgroups.push_back(
          {.id = EventgroupId{4}, .events = {multicast_event}, .multicast = Endpoint{*group, 32344}});
    }
    offer_ = node_.offer(std::move(spec));
  }

  /// notify EVENT HEX
  void notify(Words& words) {
    const MethodId event{number(next(words))};
    const std::vector<std::byte> bytes = hex(next(words));
    const ByteView view{bytes};
    const Notified sent = node_.notify(offer_, event, {&view, 1});
    tell(fmt::format("notified {}", sent.subscribers));
  }

  /// set HEX
  void set(Words& words) { node_.set_field(offer_, notifier, hex(next(words))); }

  /// require SERVICE INSTANCE MAJOR
  void require(Words& words) {
    const RequireSpec spec{.service = ServiceId{number(next(words))},
                           .instance = InstanceId{number(next(words))},
                           .major = static_cast<std::uint8_t>(number(next(words)))};
    requirement_ = node_.require(spec, [](const RemoteService& service, bool available) {
      tell(fmt::format("{} {:04x}.{:04x} v{}.{}{}{}", available ? "available" : "lost",
                       value(service.service), value(service.instance), service.major, service.minor,
                       service.udp ? " udp " + someip::to_string(*service.udp) : "",
                       service.tcp ? " tcp " + someip::to_string(*service.tcp) : ""));
    });
  }

  static CallSpec call_spec(Words& words) {
    CallSpec spec{.method = MethodId{number(next(words))}, .timeout = 30s};
    spec.transport = next(words) == "tcp" ? Transport::tcp : Transport::udp;
    return spec;
  }

  /// call METHOD udp|tcp HEX
  void call(Words& words) {
    const CallSpec spec = call_spec(words);
    const auto bytes = std::make_shared<std::vector<std::byte>>(hex(next(words)));
    const ByteView view{*bytes};
    node_.call(
        requirement_, spec, {&view, 1},
        [method = spec.method](const CallResult& result) {
          if (result) {
            tell(fmt::format("response {:04x} {}", value(method), to_hex(result->payload)));
          } else {
            tell(fmt::format("failed {:04x} {} {:02x}", value(method), to_string(result.error().fault),
                             static_cast<unsigned>(result.error().code)));
          }
        },
        bytes);
  }

  /// send METHOD udp|tcp HEX
  void send(Words& words) {
    const CallSpec spec = call_spec(words);
    const std::vector<std::byte> bytes = hex(next(words));
    const ByteView view{bytes};
    tell(node_.send(requirement_, spec, {&view, 1}) ? "sent" : "not sent");
  }

  /// subscribe SERVICE INSTANCE MAJOR EVENTGROUP EVENT udp|tcp
  void subscribe(Words& words) {
    SubscribeSpec spec{.service = ServiceId{number(next(words))},
                       .instance = InstanceId{number(next(words))},
                       .major = static_cast<std::uint8_t>(number(next(words)))};
    spec.eventgroup = EventgroupId{number(next(words))};
    spec.events = {MethodId{number(next(words))}};
    spec.tcp = next(words) == "tcp";
    spec.udp = !spec.tcp;
    subscription_ = node_.subscribe(spec, [](const Message& message, const Endpoint& from) {
      tell(fmt::format("event {:04x} session {} {} from {}", value(message.header.method),
                       value(message.header.session), to_hex(message.payload), someip::to_string(from)));
    });
  }

  void counters() {
    const NodeCounters& node = node_.counters();
    const SdCounters& sd = node_.discovery_counters();
    tell(fmt::format("counters malformed {} sd-malformed {} reboots {} nacks {} subscribed {}",
                     node.malformed, sd.dropped_malformed, sd.reboots_detected, sd.nacks_sent,
                     subscription_ == SubscriptionId{} ? false : node_.subscribed(subscription_)));
  }

  Node node_;
  OfferHandle offer_{};
  RequirementId requirement_{};
  SubscriptionId subscription_{};
  std::map<std::string, std::function<void(Words&)>> commands_;
};

/// Reads commands until the end of standard input or "quit".
class Commands {
 public:
  Commands(boost::asio::io_context& io, Peer& peer) : io_{io}, peer_{peer}, input_{io, ::dup(0)} { read(); }

 private:
  void read() {
    boost::asio::async_read_until(input_, buffer_, '\n',
                                  [this](boost::system::error_code error, std::size_t) {
                                    std::string line;
                                    std::istream in{&buffer_};
                                    if (error || !std::getline(in, line) || line == "quit") {
                                      peer_.shutdown();
                                      io_.stop();
                                      return;
                                    }
                                    peer_.obey(line);
                                    read();
                                  });
  }

  boost::asio::io_context& io_;
  Peer& peer_;
  boost::asio::posix::stream_descriptor input_;
  boost::asio::streambuf buffer_;
};

int run(const std::vector<std::string>& arguments) {
  const auto address = someip::parse_address(arguments.at(0));
  const auto group = someip::parse_address(arguments.at(1));
  if (!address || !group) {
    std::fputs("node_peer ADDRESS GROUP [TTL]\n", stderr);
    return 2;
  }
  boost::asio::io_context io;
  NodeConfig config{.address = *address, .multicast = *group};
  config.timing.initial_delay_max = 20ms;
  if (arguments.size() > 2) {
    config.timing.ttl_s = static_cast<std::uint32_t>(std::stoul(arguments[2]));
  }
  // As a bridge has it: the option in its offers must trouble nobody.
  config.gateway_to = Endpoint{IpAddress::v4(239, 255, 0, 1), 7400};
  config.unproven_answer_bytes = std::numeric_limits<std::size_t>::max();  // peers that only call
  Peer peer{io, config};
  const Commands commands{io, peer};
  tell("ready");
  io.run();
  return 0;
}

}  // namespace
}  // namespace trestle::test

int main(int argc, char** argv) {
  try {
    return trestle::test::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "node_peer: %s\n", error.what());
    return 1;
  }
}
