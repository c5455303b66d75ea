// Which threads a message passes.
#include <dirent.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/packaged_task.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <mutex>
#include <thread>

#include "sd/net/handles.hpp"
#include "sd/net/proxy.hpp"
#include "someip/wire/bytes.hpp"
#include "test/sd/net/two_nodes.hpp"
#include "test/system_calls.hpp"

namespace trestle::sd::thread_hops_test {
namespace {

struct Step {
  std::thread::id thread;
  std::string what;
};

// Of the messages of one method or event: those that begin with `id`.
struct Notes {
  std::mutex mutex;
  std::uint32_t id = 0;
  std::vector<Step> steps;

  void add(const char* what) {
    const std::lock_guard lock{mutex};
    add_locked(what);
  }
  // Several times the same is once: a large message takes several system calls.
  void add_locked(const char* what) {
    if (steps.empty() || steps.back().thread != std::this_thread::get_id() || steps.back().what != what) {
      steps.push_back({std::this_thread::get_id(), what});
    }
  }
  void look_at(const char* what, ByteView bytes) {
    const std::lock_guard lock{mutex};
    if (id != 0 && bytes.size() >= 4 && someip::load<std::uint32_t>(bytes.data()) == id) {
      add_locked(what);
    }
  }
  [[nodiscard]] std::vector<std::string> of(std::thread::id thread) {
    const std::lock_guard lock{mutex};
    std::vector<std::string> result;
    for (const Step& step : steps) {
      if (step.thread == thread) {
        result.push_back(step.what);
      }
    }
    return result;
  }
  [[nodiscard]] std::size_t size() {
    const std::lock_guard lock{mutex};
    return steps.size();
  }
};

Notes& notes() {
  static Notes one;
  return one;
}

using namespace std::chrono_literals;
using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using test::quick;
using ::testing::ElementsAre;

constexpr ServiceId service{0x1234};
constexpr MethodId echo{1};
constexpr MethodId udp_event{0x8001};
constexpr MethodId tcp_event{0x8002};

// A node's io_context and the thread that runs it.
class Loop {
 public:
  Loop() : thread_{[this] { io.run(); }} {}
  ~Loop() { io.stop(); }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;
  [[nodiscard]] std::thread::id id() const { return thread_.get_id(); }
  /// Does it on the thread.
  template <typename Work>
  auto run(Work work) {
    return boost::asio::post(io, std::packaged_task<decltype(work())()>{std::move(work)}).get();
  }

  boost::asio::io_context io;

 private:
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_ =
      boost::asio::make_work_guard(io);
  std::jthread thread_;
};

class ThreadHops : public testing::Test {
 protected:
  void SetUp() override {
    servers.run([this] {
      server.emplace(servers.io, quick(test::server_address));
      offer.emplace(*server,
                    ServiceSpec{.service = service,
                                .instance = InstanceId{1},
                                .tcp_port = std::uint16_t{0},
                                .methods = {{echo,
                                             [](const someip::Message& request, Responder responder) {
                                               notes().add("handler");
                                               responder.respond(request.payload);
                                               notes().add("return");
                                             }}},
                                .eventgroups = {{.id = EventgroupId{1}, .events = {udp_event, tcp_event}}},
                                .tcp_events = {tcp_event}});
    });
    clients.run([this] {
      client.emplace(clients.io, quick(test::client_address));
      proxy.emplace(*client, RequireSpec{.service = service});
      requirement = client->require({.service = service});
      subscription.emplace(*client,
                           SubscribeSpec{.service = service,
                                         .eventgroup = EventgroupId{1},
                                         .events = {udp_event, tcp_event},
                                         .tcp = true},
                           [this](const someip::Message&, const Endpoint&) {
                             notes().add("handler");
                             if (--awaited == 0) {
                               done.set_value();
                             }
                           });
    });
    const auto ready = [this] {
      return clients.run([this] { return subscription->active() && !proxy->available().empty(); }) &&
             servers.run([this] { return server->subscribers(offer->handle(), tcp_event) == 1; });
    };
    const auto end = std::chrono::steady_clock::now() + 30s;
    bool is_ready = false;
    while (!is_ready && std::chrono::steady_clock::now() < end) {
      is_ready = ready();
    }
    ASSERT_TRUE(is_ready);
  }
  void TearDown() override {
    notes().id = 0;
    clients.run([this] {
      subscription.reset();
      proxy.reset();
      client.reset();
    });
    servers.run([this] {
      offer.reset();
      server.reset();
    });
  }

  static void watch(MethodId method) {
    test::watch_system_calls([](const char* what, ByteView bytes) { notes().look_at(what, bytes); });
    const std::lock_guard lock{notes().mutex};
    notes().steps.clear();
    notes().id = std::uint32_t{someip::value(service)} << 16U | someip::value(method);
  }
  /// What is under way on both threads.
  void let_finish() {
    const auto flush = [] { return 0; };
    clients.run(flush);
    servers.run(flush);
  }
  void wait() { ASSERT_EQ(done.get_future().wait_for(30s), std::future_status::ready); }
  // The order that each thread saw, and that there was no other one.
  void expect(const std::vector<std::string>& client_steps, const std::vector<std::string>& server_steps,
              const std::vector<std::string>& own_steps = {}) {
    let_finish();
    EXPECT_EQ(notes().of(clients.id()), client_steps);
    EXPECT_EQ(notes().of(servers.id()), server_steps);
    EXPECT_EQ(notes().of(std::this_thread::get_id()), own_steps);
    EXPECT_EQ(notes().size(), client_steps.size() + server_steps.size() + own_steps.size());
  }

  void call_on_its_thread(Transport transport) {
    watch(echo);
    clients.run([&] {
      const ByteView payload{bytes};
      notes().add("call");
      client->call(requirement, {.method = echo, .transport = transport}, {&payload, 1},
                   [this](const CallResult& result) {
                     EXPECT_TRUE(result);
                     notes().add("handler");
                     done.set_value();
                   });
      notes().add("return");
    });
    wait();
    expect({"call", "send", "return", "receive", "handler"}, {"receive", "handler", "send", "return"});
  }
  void call_from_another_thread(Transport transport) {
    watch(echo);
    notes().add("call");
    proxy->call({.method = echo, .transport = transport}, bytes,
                [this](const boost::system::error_code& error, const Response&) {
                  EXPECT_FALSE(error) << error.message();
                  notes().add("handler");
                  done.set_value();
                });
    notes().add("return");
    wait();
    expect({"send", "receive", "handler"}, {"receive", "handler", "send", "return"}, {"call", "return"});
  }
  void notify(MethodId event) {
    watch(event);
    servers.run([&] {
      notes().add("notify");
      EXPECT_EQ(offer->notify(event, bytes).subscribers, 1U);
      notes().add("return");
    });
    wait();
    expect({"receive", "handler"}, {"notify", "send", "return"});
  }

  std::vector<std::byte> bytes = test::numbers(64);
  int awaited = 1;  ///< events
  std::promise<void> done;
  Loop servers;
  Loop clients;
  std::optional<Node> server;
  std::optional<Offer> offer;
  std::optional<Node> client;
  std::optional<Proxy> proxy;
  RequirementId requirement{};
  std::optional<Subscription> subscription;
};

TEST_F(ThreadHops, AreNoneInACallOverUdp) {
  call_on_its_thread(Transport::udp);
}

TEST_F(ThreadHops, AreNoneInACallOverTcp) {
  call_on_its_thread(Transport::tcp);
}

TEST_F(ThreadHops, IsOneInACallOverUdpFromAnotherThread) {
  call_from_another_thread(Transport::udp);
}

TEST_F(ThreadHops, IsOneInACallOverTcpFromAnotherThread) {
  call_from_another_thread(Transport::tcp);
}

TEST_F(ThreadHops, AreNoneInAnEventOverUdp) {
  notify(udp_event);
}

TEST_F(ThreadHops, AreNoneInAnEventOverTcp) {
  notify(tcp_event);
}

// So many bytes leave at once.
TEST_F(ThreadHops, AreNoneInAnEventInSegments) {
  bytes = test::numbers(20'000);
  notify(udp_event);
}

// The first of several leaves at once, the others together once the handler has returned: by this thread,
// too.
TEST_F(ThreadHops, AreNoneInEventsThatLeaveTogether) {
  awaited = 3;
  watch(udp_event);
  servers.run([&] {
    notes().add("notify");
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(offer->notify(udp_event, bytes).subscribers, 1U);
    }
    notes().add("return");
  });
  wait();
  let_finish();
  const std::vector<std::string> server_steps = notes().of(servers.id());
  EXPECT_THAT(server_steps, ElementsAre("notify", "send", "return", "send"));
  EXPECT_EQ(notes().of(clients.id()).size() + server_steps.size(), notes().size());
}

std::size_t threads_of_this_process() {
  DIR* const tasks = opendir("/proc/self/task");
  std::size_t number = 0;
  while (const dirent* const entry = readdir(tasks)) {
    number += entry->d_name[0] != '.' ? 1 : 0;
  }
  closedir(tasks);
  return number;
}

// Nobody else is needed, so that there is nobody to hand anything to, and no lock to wait for.
TEST(ThreadsOfANode, AreTheOneThatRunsIt) {
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (threads_of_this_process() > 1 && std::chrono::steady_clock::now() < end) {
    std::this_thread::yield();  // those of another test before end a little later than they are joined
  }
  boost::asio::io_context io;
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
  const Offer offer{server,
                    {.service = service,
                     .instance = InstanceId{1},
                     .tcp_port = std::uint16_t{0},
                     .methods = {{echo, [](const someip::Message& request, Responder responder) {
                                    responder.respond(request.payload);
                                  }}}}};
  Proxy proxy{client, {.service = service}};
  std::size_t most = 0;
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    std::optional<boost::system::error_code> outcome;
    proxy.call({.method = echo, .timeout = 30s, .transport = transport}, test::numbers(60'000),
               [&](const boost::system::error_code& error, const Response&) { outcome = error; });
    while (!outcome && std::chrono::steady_clock::now() < end) {
      io.run_one_for(20ms);
      most = std::max(most, threads_of_this_process());
    }
    ASSERT_TRUE(outcome);
    EXPECT_FALSE(*outcome) << outcome->message();
  }
  EXPECT_EQ(most, 1U);
}

}  // namespace
}  // namespace trestle::sd::thread_hops_test
