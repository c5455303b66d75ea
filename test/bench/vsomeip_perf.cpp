// What `trestle perf` measures, of vsomeip: the same calls and events between two of these processes, each
// with a routing manager of its own. VSOMEIP_CONFIGURATION says how.
//   trestle_vsomeip server
//   trestle_vsomeip calls udp|tcp BYTES IN_FLIGHT SECONDS
//   trestle_vsomeip events BYTES WINDOW SECONDS
#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vsomeip/vsomeip.hpp>

#include "test/bench/floor.hpp"

namespace {

using trestle::floor::Figures;
using trestle::floor::now_ns;
using Bytes = std::vector<std::uint8_t>;
using Message = std::shared_ptr<vsomeip::message>;

constexpr vsomeip::service_t service = 0x7e57;
constexpr vsomeip::instance_t instance = 1;
constexpr vsomeip::method_t echo = 0x0001;
constexpr vsomeip::method_t start = 0x0003;        ///< takes a Plan
constexpr vsomeip::method_t acknowledge = 0x0004;  ///< takes a sequence number
constexpr vsomeip::event_t event = 0x8001;
constexpr vsomeip::eventgroup_t eventgroup = 1;

/// What events to send; the bytes go as they are, on one host.
struct Plan {
  std::uint64_t bytes = 0;
  std::uint64_t window = 0;
  std::int64_t duration_ns = 0;
};
/// What events begin with.
struct Front {
  std::uint64_t sequence = 0;
  std::int64_t sent_ns = 0;
};

std::shared_ptr<vsomeip::application> app;

template <typename T>
Bytes bytes_of(const T& value) {
  Bytes bytes(sizeof value);
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

template <typename T>
T value_of(const Message& message) {
  T value{};
  const auto payload = message->get_payload();
  std::memcpy(&value, payload->get_data(), std::min<std::size_t>(sizeof value, payload->get_length()));
  return value;
}

std::shared_ptr<vsomeip::payload> payload_of(const Bytes& bytes) {
  return vsomeip::runtime::get()->create_payload(bytes);
}

/// Sends events on a thread of its own.
class Source {
 public:
  void run() {
    for (;;) {
      std::unique_lock lock{mutex_};
      changed_.wait(lock, [this] { return plan_.duration_ns != 0; });
      const Plan plan = plan_;
      plan_ = {};
      sent_ = 0;
      acknowledged_ = 0;
      Bytes bytes(plan.bytes, 0x5a);
      for (const std::int64_t end = now_ns() + plan.duration_ns; now_ns() < end && plan_.duration_ns == 0;) {
        if (plan.window > 0 && !changed_.wait_for(lock, std::chrono::milliseconds{100},
                                                  [&] { return sent_ - acknowledged_ < plan.window; })) {
          acknowledged_ = sent_;  // lost
        }
        ++sent_;
        const Front front{sent_, now_ns()};
        lock.unlock();
        std::memcpy(bytes.data(), &front, sizeof front);
        app->notify(service, instance, event, payload_of(bytes), true);
        lock.lock();
      }
    }
  }
  void on_start(const Plan& plan) {
    const std::lock_guard lock{mutex_};
    plan_ = plan;
    changed_.notify_one();
  }
  void on_acknowledge(std::uint64_t sequence) {
    const std::lock_guard lock{mutex_};
    acknowledged_ = std::clamp(sequence, acknowledged_, sent_);
    changed_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Plan plan_;
  std::uint64_t sent_ = 0;
  std::uint64_t acknowledged_ = 0;
};

void serve() {
  static Source source;
  app->offer_event(service, instance, event, {eventgroup}, vsomeip::event_type_e::ET_EVENT,
                   std::chrono::milliseconds::zero(), false, true, nullptr,
                   vsomeip::reliability_type_e::RT_UNRELIABLE);
  app->register_message_handler(service, instance, vsomeip::ANY_METHOD, [](const Message& request) {
    if (request->get_method() == start) {
      source.on_start(value_of<Plan>(request));
    } else if (request->get_method() == acknowledge) {
      source.on_acknowledge(value_of<std::uint64_t>(request));
    } else {
      const auto response = vsomeip::runtime::get()->create_response(request);
      response->set_payload(request->get_payload());
      app->send(response);
    }
  });
  app->offer_service(service, instance);
  std::thread{[] { source.run(); }}.detach();
}

void send(vsomeip::method_t method, bool tcp, const Bytes& bytes) {
  const auto request = vsomeip::runtime::get()->create_request(tcp);
  request->set_service(service);
  request->set_instance(instance);
  request->set_method(method);
  if (method != echo) {
    request->set_message_type(vsomeip::message_type_e::MT_REQUEST_NO_RETURN);
  }
  request->set_payload(payload_of(bytes));
  app->send(request);
}

class Client {
 public:
  Client(bool events, bool tcp, std::uint64_t bytes, std::uint64_t many, double seconds)
      : events_{events},
        tcp_{tcp},
        bytes_{bytes},
        many_{many},
        duration_ns_{static_cast<std::int64_t>(seconds * 1e9)} {
    figures_.bytes = bytes;
    figures_.seconds = seconds;
  }

  void request() {
    app->register_message_handler(service, instance, vsomeip::ANY_METHOD, [this](const Message& message) {
      events_ ? on_event(message) : on_answer();
    });
    app->register_availability_handler(service, instance,
                                       [this](vsomeip::service_t, vsomeip::instance_t, bool available) {
                                         const std::lock_guard lock{mutex_};
                                         available_ = available;
                                         changed_.notify_all();
                                       });
    app->request_service(service, instance);
    if (events_) {
      app->request_event(service, instance, event, {eventgroup}, vsomeip::event_type_e::ET_EVENT,
                         vsomeip::reliability_type_e::RT_UNRELIABLE);
      app->register_subscription_status_handler(
          service, instance, eventgroup, event,
          [this](vsomeip::service_t, vsomeip::instance_t, vsomeip::eventgroup_t, vsomeip::event_t,
                 std::uint16_t error) {
            const std::lock_guard lock{mutex_};
            subscribed_ = error == 0;
            changed_.notify_all();
          });
      app->subscribe(service, instance, eventgroup);
    }
  }

  /// On a thread of its own.
  void run() {
    {
      std::unique_lock lock{mutex_};
      if (!changed_.wait_for(lock, std::chrono::seconds{5},
                             [this] { return available_ && (!events_ || subscribed_); })) {
        std::fputs("trestle_vsomeip: the service is not there\n", stderr);
        std::_Exit(1);
      }
    }
    start_ = now_ns() + trestle::floor::warm_up_ns;
    if (events_) {
      send(start, false, bytes_of(Plan{bytes_, many_, duration_ns_ + trestle::floor::warm_up_ns}));
    } else {
      for (std::uint64_t i = 0; i < many_; ++i) {
        call();
      }
    }
    std::this_thread::sleep_for(std::chrono::nanoseconds{duration_ns_ + trestle::floor::warm_up_ns});
    const std::lock_guard lock{mutex_};
    over_ = true;
    if (last_ != 0) {
      figures_.lost = last_ - first_ + 1 - std::min(last_ - first_ + 1, figures_.received);
    }
    figures_.print();
    std::fflush(stdout);
    std::_Exit(0);  // vsomeip takes seconds to end
  }

 private:
  void call() {
    called_ = now_ns();
    send(echo, tcp_, Bytes(bytes_, 0x5a));
  }

  void on_answer() {
    const std::int64_t now = now_ns();
    const std::lock_guard lock{mutex_};
    if (!over_ && now >= start_) {
      ++figures_.received;
      if (many_ == 1) {
        figures_.latency.add(now - called_);
      }
    }
    call();
  }

  void on_event(const Message& message) {
    const std::int64_t now = now_ns();
    if (message->get_payload()->get_length() != bytes_) {
      return;  // for the client before
    }
    const auto front = value_of<Front>(message);
    const std::lock_guard lock{mutex_};
    if (many_ > 0 && ++since_acknowledged_ >= std::max<std::uint64_t>(many_ / 4, 1)) {
      since_acknowledged_ = 0;
      send(acknowledge, false, bytes_of(front.sequence));
    }
    if (!over_ && now >= start_) {
      first_ = first_ == 0 ? front.sequence : first_;
      last_ = std::max(last_, front.sequence);
      ++figures_.received;
      figures_.latency.add(now - front.sent_ns);
    }
  }

  bool events_;
  bool tcp_;
  std::uint64_t bytes_;
  std::uint64_t many_;
  std::int64_t duration_ns_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool available_ = false;
  bool subscribed_ = false;
  bool over_ = false;
  std::int64_t start_ = 0;
  std::int64_t called_ = 0;
  std::uint64_t since_acknowledged_ = 0;
  std::uint64_t first_ = 0;
  std::uint64_t last_ = 0;
  Figures figures_;
};

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words{argv + 1, argv + argc};
  std::unique_ptr<Client> client;
  if (words.size() == 5 && words[0] == "calls") {
    client = std::make_unique<Client>(false, words[1] == "tcp", std::stoul(words[2]), std::stoul(words[3]),
                                      std::stod(words[4]));
  } else if (words.size() == 4 && words[0] == "events") {
    client = std::make_unique<Client>(true, false, std::stoul(words[1]), std::stoul(words[2]),
                                      std::stod(words[3]));
  } else if (words != std::vector<std::string>{"server"}) {
    std::fputs(
        "Usage: trestle_vsomeip server | calls udp|tcp BYTES IN_FLIGHT SECONDS | events BYTES WINDOW "
        "SECONDS\n",
        stderr);
    return 2;
  }
  app = vsomeip::runtime::get()->create_application("bench");
  if (!app || !app->init()) {
    return 1;
  }
  std::thread running;
  app->register_state_handler([&](vsomeip::state_type_e state) {
    if (state == vsomeip::state_type_e::ST_REGISTERED && !running.joinable()) {
      if (client) {
        client->request();
        running = std::thread{[&] { client->run(); }};
      } else {
        serve();
      }
    }
  });
  app->start();
  return 0;
}
