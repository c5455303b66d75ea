// A neighbour of bridges that restarts_test.py kills and starts again: of one bridge that is killed, too, and
// of one that is not.
//
//     restarts_peer ros DOMAIN [LEASE]       publishes /up_N, /safe_N and /wild_N/up, reads /down_N and
//     /sure_N;
//                                            serves /ask_N, calls /tell_N; has the field /light_N, uses
//                                            /lamp_N; serves the action /act_N
//     restarts_peer someip ADDRESS GROUP     subscribes to service 0x1000 + N and calls its method, offers
//                                            service 0x2000 + N; uses the field of 0x3000 + N, has that of
//                                            0x4000 + N; subscribes to 0x5000 + N and offers 0x6000 + N, both
//                                            over TCP and protected; subscribes to 0x7000 + N; calls and
//                                            follows the action of 0x8000 + N
//     restarts_peer watch DOMAIN             only looks: prints every 20 ms which writers there are, and how
//                                            many readers and writers each node says it has
//
// N is 0 and 1. Each sends "PID" every 20 ms, and prints a line "up N PID" or "down N PID" for each that it
// gets: who reads them knows that what arrives is of the living. So do answers to calls, "ask N PID" and
// "tell N PID", and all three parts of a field: "light N PID", "light_get N PID", "light_set N PID". Ends
// with SIGTERM.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "dds_adapter/participant.hpp"
#include "dds_adapter/ros_graph_message.hpp"
#include "dds_adapter/ros_names.hpp"
#include "dds_adapter/service.hpp"
#include "sd/net/handles.hpp"
#include "sd/net/proxy.hpp"
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
/// @param more  behind the name.
std::vector<std::byte> with_front(const std::vector<int>& front, const std::string& more = "") {
  std::vector<std::byte> bytes;
  for (const int one : front) {
    bytes.push_back(static_cast<std::byte>(one));
  }
  for (const char one : name() + more) {
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

// The value of a field, as std_msgs/msg/String: its server's name, and a letter that is another each time.
std::string letter() {
  static unsigned count = 0;
  return {static_cast<char>('a' + count++ % 26)};
}
std::vector<std::byte> value_as_cdr() {
  return with_front({0, 1, 0, 0, 10, 0, 0, 0}, letter());
}
std::vector<std::byte> value_as_payload() {
  return with_front({0, 0, 0, 13, 0xef, 0xbb, 0xbf}, letter());
}

// The goal's id of an action: the name twice. There is one goal, which can be cancelled again and again.
std::vector<std::byte> with_goal(const std::vector<int>& front, const std::vector<int>& back) {
  std::vector<std::byte> bytes = with_front(front, name());
  bytes.pop_back();  // the zero
  for (const int one : back) {
    bytes.push_back(static_cast<std::byte>(one));
  }
  return bytes;
}

constexpr auto call_timeout = 1s;

// --- ROS --------------------------------------------------------------------------------------------------

/// Services and clients of a ROS node, worked on one thread.
class RosCalls {
 public:
  RosCalls(boost::asio::io_context& io, dds::Participant& participant) : io_{io}, participant_{participant} {}

  void serve(const std::string& name, const char* type,
             const std::function<std::vector<std::byte>()>& answer) {
    const std::size_t index = servers_.size();
    servers_.push_back(std::make_unique<dds::ServiceServer>(
        participant_, config(name, type), waker(),
        [this, index, answer](const dds::RequestId& id, const dds::ServiceMessage&) {
          const std::vector<std::byte> reply = answer();
          const dds::ByteView bytes{reply};
          servers_[index]->reply(id, {&bytes, 1}, std::chrono::steady_clock::now());
        }));
  }
  /// Calls it again and again, and prints what the answer has at a place.
  void call(const std::string& name, const char* type, const std::vector<std::byte>& request,
            const std::string& line, std::size_t place) {
    clients_.push_back(std::make_unique<Client>(participant_, config(name, type), waker()));
    clients_.back()->request = request;
    clients_.back()->line = line;
    clients_.back()->place = place;
  }
  void call_all() {
    for (const auto& client : clients_) {
      if (client->waits || !client->service.ready()) {
        continue;
      }
      client->waits = true;
      const dds::ByteView bytes{client->request};
      client->service.call(
          {&bytes, 1}, call_timeout, std::chrono::steady_clock::now(),
          [one = client.get()](const tl::expected<dds::ServiceMessage, dds::CallFault>& reply) {
            one->waits = false;
            if (reply) {
              print(fmt::format("{} {}\n", one->line, text_at(one->place, reply->cdr())));
            }
          });
    }
    work();
  }

 private:
  struct Client {
    Client(dds::Participant& participant, const dds::ServiceConfig& config, std::function<void()> wake)
        : service{participant, config, std::move(wake)} {}
    dds::ServiceClient service;
    std::vector<std::byte> request{};
    std::string line{};
    std::size_t place = 0;
    bool waits = false;
  };
  static dds::ServiceConfig config(const std::string& name, const char* type) {
    dds::ServiceConfig config;
    config.name = name;
    config.type = type;
    return config;
  }
  std::function<void()> waker() {
    return [this] { boost::asio::post(io_, [this] { work(); }); };
  }
  void work() {
    const auto now = std::chrono::steady_clock::now();
    for (const auto& client : clients_) {
      client->service.work(now);
    }
    for (const auto& server : servers_) {
      server->work(now);
    }
  }

  boost::asio::io_context& io_;
  dds::Participant& participant_;
  std::vector<std::unique_ptr<Client>> clients_;
  std::vector<std::unique_ptr<dds::ServiceServer>> servers_;
};

void ros(std::uint32_t domain, std::chrono::seconds lease) {
  boost::asio::io_context io{1};
  dds::Participant participant{{.domain = domain,
                                .name = "restarts",
                                .interfaces = {"127.0.0.1"},
                                .shared_memory = false,
                                .lease = lease,
                                .on_event = {}}};
  const std::string type = dds::ros_type_name("std_msgs/msg/String");
  constexpr dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};
  const auto printing = [](const char* what, int n) {
    return [what, n](const dds::Sample& sample) {
      print(fmt::format("{} {} {}\n", what, n, text_at(8, sample.cdr())));
    };
  };
  std::vector<dds::Writer> writers;
  std::vector<dds::Writer> feedbacks;
  std::vector<dds::Writer> statuses;
  std::vector<dds::Reader> readers;
  std::deque<dds::Writer> fields;
  RosCalls calls{io, participant};
  const std::vector<std::byte> nothing{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}, std::byte{0}};
  for (const int n : {0, 1}) {
    writers.push_back(participant.create_writer(fmt::format("rt/up_{}", n), type, {}));
    readers.push_back(participant.create_reader(fmt::format("rt/down_{}", n), type, {}, printing("down", n)));
    calls.serve(fmt::format("/ask_{}", n), "std_srvs/srv/Trigger", [] {
      return with_front({0, 1, 0, 0, 1, 0, 0, 0, 9, 0, 0, 0});
    });
    calls.call(fmt::format("/tell_{}", n), "std_srvs/srv/Trigger", nothing, fmt::format("tell {}", n), 12);
    dds::Writer& field =
        fields.emplace_back(participant.create_writer(fmt::format("rt/light_{}", n), type, latched));
    static_cast<void>(field.write(value_as_cdr()));
    calls.serve(fmt::format("/light_{}/set", n), "std_msgs_fields/srv/SetString", [&field] {
      const std::vector<std::byte> value = value_as_cdr();
      static_cast<void>(field.write(value));
      return value;
    });
    readers.push_back(
        participant.create_reader(fmt::format("rt/lamp_{}", n), type, latched, printing("lamp", n)));
    calls.call(fmt::format("/lamp_{}/get", n), "std_msgs_fields/srv/GetString", nothing,
               fmt::format("lamp_get {}", n), 8);
    calls.call(fmt::format("/lamp_{}/set", n), "std_msgs_fields/srv/SetString", value_as_cdr(),
               fmt::format("lamp_set {}", n), 8);
    writers.push_back(participant.create_writer(fmt::format("rt/safe_{}", n), type, {}));
    writers.push_back(participant.create_writer(fmt::format("rt/wild_{}/up", n), type, {}));
    readers.push_back(participant.create_reader(fmt::format("rt/sure_{}", n), type, {}, printing("sure", n)));
    const std::string action = fmt::format("/act_{}/_action/", n);
    calls.serve(action + "send_goal", "test_msgs/action/Fibonacci_SendGoal", [] {
      return with_front({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    });
    calls.serve(action + "cancel_goal", "action_msgs/srv/CancelGoal", [] {
      return with_goal({0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0});
    });
    calls.serve(action + "get_result", "test_msgs/action/Fibonacci_GetResult", [] {
      return with_front({0, 1, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0});
    });
    feedbacks.push_back(participant.create_writer(
        "rt" + action + "feedback", dds::ros_type_name("test_msgs/action/Fibonacci_FeedbackMessage"), {}));
    statuses.push_back(participant.create_writer(
        "rt" + action + "status", dds::ros_type_name("action_msgs/msg/GoalStatusArray"), latched));
  }
  const std::vector<std::byte> feedback = with_goal({0, 1, 0, 0}, {0, 0, 0, 0});
  const std::vector<std::byte> status =
      with_goal({0, 1, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0});
  const std::vector<std::byte> sample = with_front({0, 1, 0, 0, 9, 0, 0, 0});
  run(io, [&] {
    for (dds::Writer& writer : writers) {
      static_cast<void>(writer.write(sample));
    }
    for (dds::Writer& writer : feedbacks) {
      static_cast<void>(writer.write(feedback));
    }
    for (dds::Writer& writer : statuses) {
      static_cast<void>(writer.write(status));
    }
    calls.call_all();
  });
}

void watch(std::uint32_t domain) {
  boost::asio::io_context io{1};
  std::mutex mutex;
  // By participant. What was told stays: Fast DDS does not tell again when one that seemed dead comes back.
  std::map<std::string, std::string> told;
  std::set<std::string> there;
  dds::Participant participant{{.domain = domain,
                                .name = "watch",
                                .interfaces = {"127.0.0.1"},
                                .shared_memory = false,
                                .on_event = [&](const dds::Happening& event) {
                                  const std::lock_guard lock{mutex};
                                  if (event.kind == dds::Happening::Kind::peer_found) {
                                    there.insert(event.peer);
                                  } else if (event.kind == dds::Happening::Kind::peer_lost) {
                                    there.erase(event.peer);
                                  }
                                }}};
  const auto listen = [&](const dds::Sample& sample) {
    const auto heard = dds::detail::decode_entities(sample.cdr());
    if (!heard || heard->entities.nodes.size() != 1) {
      return;
    }
    const dds::detail::NodeEntities& node = heard->entities.nodes.front();
    const std::lock_guard lock{mutex};
    told[sample.writer().substr(0, 24)] = fmt::format("{}+{}", node.readers.size(), node.writers.size());
  };
  const dds::Reader graph =
      participant.create_reader("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
                                {.reliable = true, .transient_local = true, .depth = 1}, listen);
  run(io, [&] {
    std::vector<std::string> words;
    for (const dds::FoundWriter& writer : participant.writers()) {
      words.push_back(writer.topic);
    }
    {
      const std::lock_guard lock{mutex};
      for (const auto& [peer, entities] : told) {
        if (there.contains(peer)) {
          words.push_back(entities);
        }
      }
    }
    std::ranges::sort(words);
    print(fmt::format("{}\n", fmt::join(words, " ")));
  });
}

// --- SOME/IP ----------------------------------------------------------------------------------------------

constexpr someip::MethodId event{0x8001};
constexpr someip::MethodId method{0x0001};
constexpr someip::MethodId getter{0x0002};
constexpr someip::MethodId setter{0x0003};
constexpr someip::MethodId cancel_goal{0x0012};
constexpr someip::MethodId feedback_event{0x8011};
constexpr someip::MethodId status_event{0x8012};
constexpr someip::EventgroupId eventgroup{1};

/// As restarts_test.py has it in the routes of these services.
someip::e2e::Config protection(std::uint16_t service) {
  return someip::e2e::Profile4{.data_id = service};
}

/// A method of a service of others, called again and again.
struct SomeipCall {
  sd::Proxy proxy;
  someip::MethodId id;
  std::vector<std::byte> request;
  std::string line;
  std::size_t place;  ///< of what is printed, in the answer
  bool waits = false;

  void call() {
    if (waits || proxy.available().empty()) {
      return;
    }
    waits = true;
    proxy.call({.method = id, .timeout = call_timeout}, request,
               [this](boost::system::error_code error, const sd::Response& response) {
                 waits = false;
                 if (!error) {
                   print(fmt::format("{} {}\n", line, text_at(place, response.payload)));
                 }
               });
  }
};

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
  const auto follow = [&](std::uint16_t service, const char* what, unsigned n) {
    node.subscribe({.service = someip::ServiceId{service}, .eventgroup = eventgroup, .events = {event}},
                   [what, n](const someip::Message& message, const Endpoint&) {
                     print(fmt::format("{} {} {}\n", what, n, text_at(7, message.payload)));
                   });
  };
  std::vector<sd::OfferHandle> offers;
  std::deque<SomeipCall> calls;
  const auto call = [&](std::uint16_t service, someip::MethodId id, const std::vector<std::byte>& request,
                        const std::string& line, std::size_t place) {
    calls.push_back({{node, {.service = someip::ServiceId{service}}}, id, request, line, place});
  };
  for (const std::uint16_t n : {std::uint16_t{0}, std::uint16_t{1}}) {
    const auto of = [n](unsigned service) { return static_cast<std::uint16_t>(service + n); };
    follow(of(0x1000), "up", n);
    call(of(0x1000), method, {}, fmt::format("ask {}", n), 8);
    offers.push_back(
        node.offer({.service = someip::ServiceId{of(0x2000)},
                    .instance = someip::InstanceId{1},
                    .methods = {{method,
                                 [](const someip::Message&, sd::Responder responder) {
                                   responder.respond(with_front({1, 0, 0, 0, 12, 0xef, 0xbb, 0xbf}));
                                 }}},
                    .eventgroups = {{.id = eventgroup, .events = {event}}}}));
    follow(of(0x3000), "light", n);
    node.subscribe({.service = someip::ServiceId{of(0x5000)},
                    .eventgroup = eventgroup,
                    .events = {event},
                    .udp = false,
                    .tcp = true,
                    .e2e = {{.id = event, .check = protection(of(0x5000))}}},
                   [n](const someip::Message& message, const Endpoint&) {
                     print(fmt::format("safe {} {}\n", n, text_at(7, message.payload)));
                   });
    offers.push_back(node.offer({.service = someip::ServiceId{of(0x6000)},
                                 .instance = someip::InstanceId{1},
                                 .udp_port = {},
                                 .tcp_port = 0,
                                 .eventgroups = {{.id = eventgroup, .events = {event}}},
                                 .e2e = {{.id = event, .protect = protection(of(0x6000))}}}));
    follow(of(0x7000), "wild", n);
    call(of(0x8000), cancel_goal, std::vector<std::byte>(24), fmt::format("cancel {}", n), 5);
    node.subscribe({.service = someip::ServiceId{of(0x8000)},
                    .eventgroup = eventgroup,
                    .events = {feedback_event, status_event}},
                   [n](const someip::Message& message, const Endpoint&) {
                     const bool is_status = message.header.method == status_event;
                     print(fmt::format("{} {} {}\n", is_status ? "status" : "feedback", n,
                                       text_at(is_status ? 4 : 0, message.payload)));
                   });
    call(of(0x3000), getter, {}, fmt::format("light_get {}", n), 7);
    call(of(0x3000), setter, value_as_payload(), fmt::format("light_set {}", n), 7);
    node.offer({.service = someip::ServiceId{of(0x4000)},
                .instance = someip::InstanceId{1},
                .fields = {{.getter = getter,
                            .setter = setter,
                            .notifier = event,
                            .value = value_as_payload(),
                            .on_set = [](ByteView) { return value_as_payload(); }}},
                .eventgroups = {{.id = eventgroup, .events = {event}}}});
  }
  const std::vector<std::byte> payload = with_front({0, 0, 0, 12, 0xef, 0xbb, 0xbf});
  run(io, [&] {
    const ByteView bytes{payload};
    for (const sd::OfferHandle offer : offers) {
      node.notify(offer, event, {&bytes, 1});
    }
    for (SomeipCall& one : calls) {
      one.call();
    }
  });
  node.shutdown();
}

}  // namespace
}  // namespace trestle::test

int main(int count, char** words) {
  const std::vector<std::string> arguments(words, words + count);
  fcntl(STDOUT_FILENO, F_SETFL, fcntl(STDOUT_FILENO, F_GETFL) | O_NONBLOCK);
  if ((arguments.size() == 3 || arguments.size() == 4) && arguments[1] == "ros") {
    const std::chrono::seconds lease{arguments.size() == 4 ? std::stoi(arguments[3]) : 1};
    trestle::test::ros(static_cast<std::uint32_t>(std::stoul(arguments[2])), lease);
    return 0;
  }
  if (arguments.size() == 3 && arguments[1] == "watch") {
    trestle::test::watch(static_cast<std::uint32_t>(std::stoul(arguments[2])));
    return 0;
  }
  if (arguments.size() == 4 && arguments[1] == "someip") {
    trestle::test::someip(*trestle::someip::parse_address(arguments[2]),
                          *trestle::someip::parse_address(arguments[3]));
    return 0;
  }
  return 2;
}
