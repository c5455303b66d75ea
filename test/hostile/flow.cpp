// The honest ends of `./run test hostile`: they send and receive what the time of day is in, and write a line
// for each message to standard output. What was lost, how long it took and what nobody sent is worked out by
// flows.py.
//
//   hostile_flow peer ADDRESS PART...   an end in SOME/IP, with one Node
//   hostile_flow dds DOMAIN PART...     an end in DDS
//   hostile_flow old ADDRESS:DOMAIN PART...   a bridge that does not say that it is one, on all interfaces
//
// A part is FLOW=KIND:WORD:..., and a line is KIND FLOW NUMBER...: numbers are nanoseconds of
// CLOCK_MONOTONIC.
//   S  sent, when           R  received: when it was sent, when it came      C  called: when, answered when
//   (0: not) Q  asked as a server    V  a server is there (1) or gone (0), when       U  up: everything is
//   open                F  called, and the answer was forged: when
#include <fmt/format.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bridge/cli/on_signal.hpp"
#include "bridge/measure/point_cloud.hpp"
#include "bridge/measure/report.hpp"
#include "dds_adapter/ros_names.hpp"
#include "dds_adapter/service.hpp"
#include "sd/net/node.hpp"
#include "someip/net/address_text.hpp"
#include "someip/wire/bytes.hpp"
#include "test/hostile/flow_parts.hpp"
#include "test/hostile/old_bridge.hpp"

namespace trestle::test {
namespace {

using measure::monotonic_ns;
using namespace std::chrono_literals;

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::byte forged_mark{0xf0};  ///< begins answers that nobody of ours has given
constexpr std::uint32_t point_bytes = 16;

/// Does something so many times a second, by a clock that does not slip.
class Ticker {
 public:
  Ticker(boost::asio::io_context& io, double rate_hz, std::function<void()> what)
      : timer_{io},
        period_{std::chrono::nanoseconds{static_cast<std::int64_t>(1e9 / rate_hz)}},
        what_{std::move(what)} {
    due_ = std::chrono::steady_clock::now() + period_;
    wait();
  }

 private:
  void wait() {
    timer_.expires_at(due_);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        what_();
        due_ += period_;
        if (due_ < std::chrono::steady_clock::now()) {  // after a stall of the machine no burst
          due_ = std::chrono::steady_clock::now() + period_;
        }
        wait();
      }
    });
  }

  boost::asio::steady_timer timer_;
  std::chrono::nanoseconds period_;
  std::chrono::steady_clock::time_point due_;
  std::function<void()> what_;
};

/// A PointCloud2 as the specification lays it out, whose stamp is the time.
std::vector<std::byte> someip_cloud(std::size_t bytes, std::int64_t stamp_ns) {
  const std::size_t points = std::max<std::size_t>(bytes / point_bytes, 1);
  std::vector<std::byte> out(64 + points * point_bytes);
  someip::ByteWriter to{out};
  to.u32(static_cast<std::uint32_t>(stamp_ns / second_ns));
  to.u32(static_cast<std::uint32_t>(stamp_ns % second_ns));
  to.u32(4);  // a string without characters: BOM and terminator
  to.u32(0xefbbbf00);
  to.u32(1);  // height
  to.u32(static_cast<std::uint32_t>(points));
  to.u32(0);  // no fields
  to.u8(0);
  to.u32(point_bytes);
  to.u32(static_cast<std::uint32_t>(points * point_bytes));
  to.u32(static_cast<std::uint32_t>(points * point_bytes));
  const std::size_t before = 8 + 8 + 8 + 4 + 1 + 12;
  out.resize(before + points * point_bytes + 1);
  return out;
}

/// When a message of ours was sent: of a cloud, its stamp.
std::int64_t someip_stamp(ByteView payload) {
  someip::ByteReader in{payload};
  const std::int64_t seconds = in.u32();
  const std::int64_t ns = in.u32();
  return in.failed() ? 0 : seconds * second_ns + ns;
}

class Peer {
 public:
  Peer(boost::asio::io_context& io, Lines& lines, const std::string& address, int receive_buffer)
      : io_{io}, lines_{lines}, node_{io, config(address, receive_buffer), [](const std::string& line) {
                                        std::fprintf(stderr, "%s\n", line.c_str());
                                      }} {}

  void add(const Part& part) {
    const std::string& kind = part.word(0);
    if (kind == "listen") {
      listen(part);
    } else if (kind == "notify") {
      notify(part);
    } else if (kind == "call") {
      call(part);
    } else if (kind == "serve") {
      serve(part);
    } else if (kind == "relay") {
      relay(part);
    } else {
      throw std::invalid_argument{"no such part of a peer: " + kind};
    }
  }
  void shutdown() { node_.shutdown(); }

 private:
  static sd::NodeConfig config(const std::string& address, int receive_buffer) {
    sd::NodeConfig config{.address = someip::parse_address(address).value()};
    if (config.address.v6) {
      config.multicast = someip::parse_address("ff15::84").value();
    }
    if (receive_buffer > 0) {
      config.receive_buffer_bytes = receive_buffer;
    }
    return config;
  }

  /// listen:SERVICE:INSTANCE:udp|tcp:PORT, instance 0xffff is any; port 0: the system chooses
  void listen(const Part& part) {
    const bool tcp = part.word(3, "udp") == "tcp";
    node_.subscribe(
        {.service = someip::ServiceId{part.id(1)},
         .instance = someip::InstanceId{part.id(2)},
         .eventgroup = the_eventgroup,
         .events = {the_event},
         .udp = !tcp,
         .tcp = tcp,
         .port = static_cast<std::uint16_t>(std::stoul(part.word(4, "0")))},
        [this, flow = part.flow](const someip::Message& message, const Endpoint& /*from*/) {
          lines_.add(fmt::format("R {} {} {}", flow, someip_stamp(message.payload), monotonic_ns()));
        });
  }

  /// notify:SERVICE:INSTANCE:BYTES:HZ:udp|tcp
  void notify(const Part& part) {
    const bool tcp = part.word(5, "udp") == "tcp";
    sd::ServiceSpec spec{.service = someip::ServiceId{part.id(1)},
                         .instance = someip::InstanceId{part.id(2)}};
    if (tcp) {
      spec.udp_port = std::nullopt;
      spec.tcp_port = 0;
    }
    spec.eventgroups = {{.id = the_eventgroup, .events = {the_event}}};
    const sd::OfferHandle offer = node_.offer(std::move(spec));
    const auto bytes = static_cast<std::size_t>(part.number(3));
    tickers_.push_back(std::make_unique<Ticker>(
        io_, part.number(4), [this, offer, bytes, flow = part.flow, begun = false]() mutable {
          begun = begun || node_.subscribers(offer, the_event) > 0;
          if (!begun) {
            return;  // from then on, what nobody is subscribed to is lost
          }
          const std::int64_t now = monotonic_ns();
          const auto cloud = std::make_shared<std::vector<std::byte>>(someip_cloud(bytes, now));
          const ByteView view{*cloud};
          lines_.add(fmt::format("S {} {}", flow, now));
          node_.notify(offer, the_event, {&view, 1}, cloud);
        }));
  }

  /// relay:FROM:TO, what a bridge of another maker does that closes a ring
  void relay(const Part& part) {
    sd::ServiceSpec spec{.service = someip::ServiceId{part.id(2)}, .instance = someip::InstanceId{1}};
    spec.eventgroups = {{.id = the_eventgroup, .events = {the_event}}};
    const sd::OfferHandle offer = node_.offer(std::move(spec));
    node_.subscribe(
        {.service = someip::ServiceId{part.id(1)},
         .instance = someip::InstanceId{1},
         .eventgroup = the_eventgroup,
         .events = {the_event}},
        [this, offer, flow = part.flow](const someip::Message& message, const Endpoint& /*from*/) {
          lines_.add(fmt::format("S {} {}", flow, monotonic_ns()));
          node_.notify(offer, the_event, {&message.payload, 1});
        });
  }

  /// call:SERVICE:INSTANCE:METHOD:BYTES:HZ:udp|tcp
  void call(const Part& part) {
    const std::string flow = part.flow;
    const sd::RequirementId service =
        node_.require({.service = someip::ServiceId{part.id(1)}, .instance = someip::InstanceId{part.id(2)}},
                      [this, flow](const sd::RemoteService& /*server*/, bool there) {
                        lines_.add(fmt::format("V {} {} {}", flow, int{there}, monotonic_ns()));
                      });
    const sd::CallSpec spec{.method = someip::MethodId{part.id(3)},
                            .timeout = 1s,
                            .transport = part.word(6, "udp") == "tcp" ? Transport::tcp : Transport::udp};
    const auto bytes = static_cast<std::size_t>(part.number(4));
    tickers_.push_back(std::make_unique<Ticker>(io_, part.number(5), [this, service, spec, bytes, flow] {
      const std::vector<std::byte> payload(bytes);
      const ByteView view{payload};
      node_.call(service, spec, {&view, 1},
                 [this, flow, start = monotonic_ns()](const sd::CallResult& result) {
                   lines_.add(fmt::format("C {} {} {}", flow, start, result ? monotonic_ns() : 0));
                   if (result && !result->payload.empty() && result->payload[0] == forged_mark) {
                     lines_.add(fmt::format("F {} {}", flow, monotonic_ns()));
                   }
                 });
    }));
  }

  /// serve:SERVICE:INSTANCE:BYTES, method 1 is an echo, 2 the getter of so many bytes, 3 takes anything
  void serve(const Part& part) {
    sd::ServiceSpec spec{.service = someip::ServiceId{part.id(1)},
                         .instance = someip::InstanceId{part.id(2)},
                         .tcp_port = std::uint16_t{0}};
    spec.methods = {
        {.id = someip::MethodId{1},
         .handler =
             [this, flow = part.flow](const someip::Message& request, sd::Responder responder) {
               lines_.add(fmt::format("Q {} {}", flow, monotonic_ns()));
               responder.respond(request.payload);
             }},
        {.id = someip::MethodId{3},
         .handler = [this, flow = part.flow](const someip::Message& /*request*/, sd::Responder responder) {
           lines_.add(fmt::format("Q {} {}", flow, monotonic_ns()));
           responder.respond();
         }}};
    spec.fields = {{.getter = someip::MethodId{2},
                    .value = std::vector<std::byte>(static_cast<std::size_t>(part.number(3)))}};
    node_.offer(std::move(spec));
  }

  boost::asio::io_context& io_;
  Lines& lines_;
  sd::Node node_;
  std::vector<std::unique_ptr<Ticker>> tickers_;
};

/// What a sample of ours is: a cloud, or a string that is the time in digits.
struct Kind {
  bool cloud = true;
  explicit Kind(const std::string& name) : cloud{name == "cloud"} {}
  [[nodiscard]] std::string type() const {
    return dds::ros_type_name(cloud ? "sensor_msgs/msg/PointCloud2" : "std_msgs/msg/String");
  }
  [[nodiscard]] std::int64_t stamp(ByteView cdr) const {
    if (cloud) {
      const auto view = measure::decode(cdr);
      return view ? view->stamp_ns : 0;
    }
    std::string text;  // behind encapsulation and length
    for (const std::byte byte : cdr.size() > 8 ? cdr.subspan(8) : ByteView{}) {
      text += static_cast<char>(byte);
    }
    std::int64_t stamp = 0;
    std::from_chars(text.data(), text.data() + text.size(), stamp);
    return stamp;
  }
};

std::vector<std::byte> string_sample(std::int64_t stamp) {
  const std::string text = std::to_string(stamp);
  std::vector<std::byte> out{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  const auto length = static_cast<std::uint32_t>(text.size() + 1);
  for (unsigned shift = 0; shift < 32; shift += 8) {
    out.push_back(static_cast<std::byte>(length >> shift & 0xffU));
  }
  for (const char c : text) {
    out.push_back(static_cast<std::byte>(c));
  }
  out.push_back(std::byte{0});
  return out;
}

class DdsEnd {
 public:
  DdsEnd(boost::asio::io_context& io, Lines& lines, std::uint32_t domain, bool loopback)
      : io_{io},
        lines_{lines},
        participant_{
            {.domain = domain,
             .name = "hostile_flow",
             .interfaces = loopback ? std::vector<std::string>{"127.0.0.1"} : std::vector<std::string>{},
             .on_event = {}}} {}

  void add(const Part& part) {
    const std::string& kind = part.word(0);
    if (kind == "publish") {
      publish(part);
    } else if (kind == "read") {
      read(part);
    } else if (kind == "answer") {
      answer(part);
    } else if (kind == "ask") {
      ask(part);
    } else {
      throw std::invalid_argument{"no such part of DDS: " + kind};
    }
  }

 private:
  static dds::Qos qos(const Part& part, std::size_t word) {
    const std::string how = part.word(word, "reliable");
    return {.reliable = how != "best_effort",
            .transient_local = how == "latched",
            .depth = how == "latched" ? 1U : 50U};
  }

  /// publish:TOPIC:cloud|string:BYTES:HZ:reliable|best_effort|latched:COUNT; without HZ (0) one, when it
  /// begins
  void publish(const Part& part) {
    const Kind kind{part.word(2)};
    const auto writer = std::make_shared<dds::Writer>(
        participant_.create_writer(dds::ros_topic_name(part.word(1)), kind.type(), qos(part, 5)));
    measure::Cloud cloud;
    cloud.width = std::max<std::uint32_t>(static_cast<std::uint32_t>(part.number(3)) / point_bytes, 1);
    cloud.point_bytes = point_bytes;
    cloud.data.resize(std::size_t{cloud.width} * point_bytes);
    const auto most = static_cast<std::uint64_t>(std::stod(part.word(6, "1e18")));
    const std::size_t readers = std::stoul(part.word(7, "1"));
    const auto send = [this, writer, kind, cloud = std::move(cloud), flow = part.flow, most, readers,
                       sent = std::uint64_t{0}, latched = qos(part, 5).transient_local]() mutable {
      if (sent == most || (sent == 0 && writer->matched() < readers && !latched)) {
        return;
      }
      ++sent;
      const std::int64_t now = monotonic_ns();
      lines_.add(fmt::format("S {} {}", flow, now));
      if (kind.cloud) {
        const auto encoded = measure::encode(cloud, now, "");
        const std::array<ByteView, 3> slices{encoded.front, encoded.data, ByteView{&encoded.tail, 1}};
        (void)writer->write(slices);
      } else {
        (void)writer->write(string_sample(now));
      }
    };
    if (part.number(4) > 0) {
      tickers_.push_back(std::make_unique<Ticker>(io_, part.number(4), send));
    } else {
      auto once = send;
      once();
      keep_.push_back(writer);
    }
  }

  /// read:TOPIC:cloud|string:reliable|best_effort
  void read(const Part& part) {
    const Kind kind{part.word(2)};
    readers_.push_back(participant_.create_reader(
        dds::ros_topic_name(part.word(1)), kind.type(), qos(part, 3),
        [this, kind, flow = part.flow](dds::Sample sample) {
          lines_.add(fmt::format("R {} {} {}", flow, kind.stamp(sample.cdr()), monotonic_ns()));
        }));
  }

  /// answer:SERVICE, a std_srvs/srv/SetBool that says yes
  void answer(const Part& part) {
    struct Server {
      std::unique_ptr<dds::ServiceServer> server;
    };
    const auto held = std::make_shared<Server>();
    const auto work = [this, held] {
      boost::asio::post(io_, [held] {
        if (held->server) {
          held->server->work(std::chrono::steady_clock::now());
        }
      });
    };
    held->server = std::make_unique<dds::ServiceServer>(
        participant_, dds::ServiceConfig{.name = part.word(1), .type = "std_srvs/srv/SetBool"}, work,
        [this, held = held.get(), flow = part.flow](const dds::RequestId& id,
                                                    const dds::ServiceMessage& /*request*/) {
          lines_.add(fmt::format("Q {} {}", flow, monotonic_ns()));
          // success, padding, and an empty string
          const std::array<std::byte, 13> yes{std::byte{0}, std::byte{1}, std::byte{0},
                                              std::byte{0}, std::byte{1}, std::byte{0},
                                              std::byte{0}, std::byte{0}, std::byte{1}};
          const ByteView view{yes};
          held->server->reply(id, {&view, 1}, std::chrono::steady_clock::now());
        });
    tickers_.push_back(std::make_unique<Ticker>(io_, 100, work));
  }

  /// ask:SERVICE:HZ:COUNT, calls a std_srvs/srv/SetBool
  void ask(const Part& part) {
    struct Client {
      std::unique_ptr<dds::ServiceClient> client;
      std::uint64_t left = 0;
    };
    const auto held = std::make_shared<Client>();
    held->left = static_cast<std::uint64_t>(part.number(3));
    const auto work = [this, held] {
      boost::asio::post(io_, [held] {
        if (held->client) {
          held->client->work(std::chrono::steady_clock::now());
        }
      });
    };
    held->client = std::make_unique<dds::ServiceClient>(
        participant_, dds::ServiceConfig{.name = part.word(1), .type = "std_srvs/srv/SetBool"}, work);
    tickers_.push_back(std::make_unique<Ticker>(io_, 100, work));
    tickers_.push_back(std::make_unique<Ticker>(io_, part.number(2), [this, held, flow = part.flow] {
      if (held->left == 0 || !held->client->ready()) {
        return;
      }
      --held->left;
      const std::array<std::byte, 5> yes{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0},
                                         std::byte{1}};
      const ByteView view{yes};
      held->client->call({&view, 1}, 5s, std::chrono::steady_clock::now(),
                         [this, flow, start = monotonic_ns()](const auto& reply) {
                           lines_.add(fmt::format("C {} {} {}", flow, start, reply ? monotonic_ns() : 0));
                         });
    }));
  }

  boost::asio::io_context& io_;
  Lines& lines_;
  dds::Participant participant_;
  std::vector<dds::Reader> readers_;
  std::vector<std::shared_ptr<dds::Writer>> keep_;
  std::vector<std::unique_ptr<Ticker>> tickers_;
};

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 2 || (arguments[0] != "peer" && arguments[0] != "dds" && arguments[0] != "old")) {
    std::fputs("hostile_flow peer ADDRESS[,BUFFER]|dds DOMAIN[,all]|old ADDRESS:DOMAIN FLOW=KIND:WORD:...\n",
               stderr);
    return 2;
  }
  boost::asio::io_context io;
  Lines lines;
  std::unique_ptr<Peer> peer;
  std::unique_ptr<DdsEnd> dds_end;
  std::unique_ptr<OldBridge> old_bridge;
  const cli::OnSignal stop{io, {SIGINT, SIGTERM}, [&](int) {
                             if (peer) {
                               peer->shutdown();
                             }
                             if (old_bridge) {
                               old_bridge->shutdown();
                             }
                             io.stop();
                           }};
  const std::string where = arguments[1].substr(0, arguments[1].find(','));
  const std::string extra = arguments[1].substr(std::min(where.size() + 1, arguments[1].size()));
  if (arguments[0] == "peer") {
    peer = std::make_unique<Peer>(io, lines, where, extra.empty() ? 0 : std::stoi(extra));
  } else if (arguments[0] == "old") {
    const std::size_t colon = where.find(':');
    old_bridge = std::make_unique<OldBridge>(io, lines, where.substr(0, colon),
                                             static_cast<std::uint32_t>(std::stoul(where.substr(colon + 1))));
  } else {
    dds_end =
        std::make_unique<DdsEnd>(io, lines, static_cast<std::uint32_t>(std::stoul(where)), extra != "all");
  }
  for (std::size_t i = 2; i < arguments.size(); ++i) {
    const Part part{arguments[i]};
    peer ? peer->add(part) : old_bridge ? old_bridge->add(part) : dds_end->add(part);
  }
  lines.add(fmt::format("U - {}", monotonic_ns()));
  const Ticker flush{io, 20, [&lines] { lines.flush(); }};
  io.run();
  lines.flush();
  return 0;
}

}  // namespace
}  // namespace trestle::test

int main(int argc, char** argv) {
  try {
    return trestle::test::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hostile_flow: %s\n", error.what());
    return 1;
  }
}
