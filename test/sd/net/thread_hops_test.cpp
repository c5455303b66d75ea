// Which threads a message passes: all system calls of this program that send or receive are noted on their
// way to the kernel, with the thread that makes them.
#include <dirent.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/packaged_task.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <mutex>
#include <thread>

#include "sd/net/handles.hpp"
#include "sd/net/proxy.hpp"
#include "test/sd/net/two_nodes.hpp"

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
  void look_at(const char* what, const void* data, std::size_t bytes) {
    const std::lock_guard lock{mutex};
    if (id == 0 || bytes < 4) {
      return;
    }
    const auto* const byte = static_cast<const unsigned char*>(data);
    if ((std::uint32_t{byte[0]} << 24U | byte[1] << 16U | byte[2] << 8U | byte[3]) == id) {
      add_locked(what);
    }
  }
  void look_at(const char* what, std::span<const iovec> parts, std::size_t bytes) {
    for (const iovec& part : parts) {
      if (part.iov_len > 0) {
        return look_at(what, part.iov_base, std::min(bytes, part.iov_len));
      }
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

constexpr std::size_t all = static_cast<std::size_t>(-1);

template <typename... Arguments>
ssize_t pass(long number, Arguments... arguments) {
  return syscall(number, arguments...);
}
ssize_t received(ssize_t bytes, std::span<const iovec> parts) {
  if (bytes > 0) {
    notes().look_at("receive", parts, static_cast<std::size_t>(bytes));
  }
  return bytes;
}
std::span<const iovec> parts_of(const msghdr& message) {
  return {message.msg_iov, message.msg_iovlen};
}
std::span<const iovec> parts_of(const iovec* parts, int count) {
  return {parts, static_cast<std::size_t>(count)};
}

}  // namespace
}  // namespace trestle::sd::thread_hops_test

// The program's own functions go before those of the C library.
// NOLINTBEGIN(*-reserved-identifier, *-identifier-naming, cert-dcl*)
namespace hops = trestle::sd::thread_hops_test;

extern "C" {

ssize_t sendmsg(int fd, const msghdr* message, int flags) {
  hops::notes().look_at("send", hops::parts_of(*message), hops::all);
  return hops::pass(SYS_sendmsg, fd, message, flags);
}
int sendmmsg(int fd, mmsghdr* messages, unsigned count, int flags) {
  for (unsigned i = 0; i < count; ++i) {
    hops::notes().look_at("send", hops::parts_of(messages[i].msg_hdr), hops::all);
  }
  return static_cast<int>(hops::pass(SYS_sendmmsg, fd, messages, count, flags));
}
ssize_t sendto(int fd, const void* data, size_t bytes, int flags, const sockaddr* to, socklen_t size) {
  hops::notes().look_at("send", data, bytes);
  return hops::pass(SYS_sendto, fd, data, bytes, flags, to, size);
}
ssize_t send(int fd, const void* data, size_t bytes, int flags) {
  return sendto(fd, data, bytes, flags, nullptr, 0);
}
ssize_t write(int fd, const void* data, size_t bytes) {
  hops::notes().look_at("send", data, bytes);
  return hops::pass(SYS_write, fd, data, bytes);
}
ssize_t writev(int fd, const iovec* parts, int count) {
  hops::notes().look_at("send", hops::parts_of(parts, count), hops::all);
  return hops::pass(SYS_writev, fd, parts, count);
}
ssize_t recvmsg(int fd, msghdr* message, int flags) {
  return hops::received(hops::pass(SYS_recvmsg, fd, message, flags), hops::parts_of(*message));
}
int recvmmsg(int fd, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
  const auto number = static_cast<int>(hops::pass(SYS_recvmmsg, fd, messages, count, flags, timeout));
  for (int i = 0; i < number; ++i) {
    hops::received(messages[i].msg_len, hops::parts_of(messages[i].msg_hdr));
  }
  return number;
}
ssize_t recvfrom(int fd, void* data, size_t bytes, int flags, sockaddr* from, socklen_t* size) {
  const iovec part{data, bytes};
  return hops::received(hops::pass(SYS_recvfrom, fd, data, bytes, flags, from, size), {&part, 1});
}
ssize_t recv(int fd, void* data, size_t bytes, int flags) {
  return recvfrom(fd, data, bytes, flags, nullptr, nullptr);
}
ssize_t read(int fd, void* data, size_t bytes) {
  const iovec part{data, bytes};
  return hops::received(hops::pass(SYS_read, fd, data, bytes), {&part, 1});
}
ssize_t readv(int fd, const iovec* parts, int count) {
  return hops::received(hops::pass(SYS_readv, fd, parts, count), hops::parts_of(parts, count));
}

}  // extern "C"
// NOLINTEND(*-reserved-identifier, *-identifier-naming, cert-dcl*)

namespace trestle::sd::thread_hops_test {
namespace {

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
    const std::lock_guard lock{notes().mutex};
    notes().steps.clear();
    notes().id = std::uint32_t{someip::value(service)} << 16U | someip::value(method);
  }
  void wait() { ASSERT_EQ(done.get_future().wait_for(30s), std::future_status::ready); }
  // The order that each thread saw, and that there was no other one.
  void expect(const std::vector<std::string>& client_steps, const std::vector<std::string>& server_steps,
              const std::vector<std::string>& own_steps = {}) {
    const auto flush = [] { return 0; };  // what was under way on both threads is over
    clients.run(flush);
    servers.run(flush);
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
