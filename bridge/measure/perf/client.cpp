#include "bridge/measure/perf/client.hpp"

#include <fmt/format.h>

#include <array>
#include <boost/asio/io_context.hpp>

#include "bridge/measure/report.hpp"
#include "someip/net/parameters.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::measure::perf {
namespace {

using namespace std::chrono_literals;

/// Round trips for comparing clocks; the shortest one counts.
constexpr unsigned clock_samples = 20;
/// The pause before something is tried again that was not possible yet.
constexpr Duration pause = 5ms;

std::string words(const ClientOptions& options) {
  if (!options.events) {
    return fmt::format("{} in flight", options.in_flight);
  }
  const EventPlan& plan = options.plan;
  return (plan.rate_hz > 0 ? fmt::format("{} a second", plan.rate_hz)
                           : std::string{"as many as there can be"}) +
         (plan.window > 0 ? fmt::format(", {} under way", plan.window) : "");
}

}  // namespace

Client::Client(sd::Node& node, const ClientOptions& options, Progress progress, Done done)
    : node_{node},
      options_{options},
      progress_{std::move(progress)},
      done_{std::move(done)},
      timer_{node.io()},
      limit_{node.io()},
      request_(options.plan.bytes, std::byte{0x5a}) {
  result_.what = options.events ? "events" : "calls";
  result_.transport = options.plan.tcp ? "tcp" : "udp";
  result_.payload_bytes = options.plan.bytes;
  result_.how = words(options);
  service_ = node_.require(
      {.service = options.service, .instance = options.instance},
      [this](const sd::RemoteService& service, bool available) { on_service(service, available); });
  limit_.expires_after(options.patience);
  limit_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      end(phase_ == Phase::finding ? "nobody offers the service"
          : options_.events        ? "the service sends no events"
                                   : "the service does not answer");
    }
  });
}

Client::~Client() {
  phase_ = Phase::over;
  if (subscription_) {
    node_.unsubscribe(*subscription_);
  }
  node_.release(service_);
}

void Client::on_service(const sd::RemoteService& service, bool available) {
  if (!available) {
    end("the service is gone");
    return;
  }
  if (phase_ != Phase::finding) {
    return;  // another instance
  }
  if (options_.plan.tcp ? !service.tcp : !service.udp) {
    end(fmt::format("the service is not offered by {}", options_.plan.tcp ? "TCP" : "UDP"));
    return;
  }
  phase_ = Phase::preparing;
  if (options_.events) {
    subscription_ = node_.subscribe(
        {.service = options_.service,
         .instance = service.instance,
         .eventgroup = options_.plan.tcp ? tcp_eventgroup : udp_eventgroup,
         .events = {options_.plan.tcp ? tcp_event : udp_event},
         .udp = !options_.plan.tcp,
         .tcp = options_.plan.tcp},
        [this](const someip::Message& message, const Endpoint& /*from*/) { on_event(message); });
  } else if (!options_.plan.tcp) {
    subscription_ = node_.subscribe({.service = options_.service,
                                     .instance = service.instance,
                                     .eventgroup = callers_eventgroup,
                                     .events = {no_event}},
                                    [](const someip::Message& /*event*/, const Endpoint& /*from*/) {});
  }
  compare_clocks();
}

void Client::ask(someip::MethodId method, StatusHandler handler, Duration left) {
  // In a flood of events answers may get lost, so ask again after a short time.
  const Duration timeout = std::min<Duration>(left, 500ms);
  node_.call(
      service_, {.method = method, .timeout = timeout, .transport = Transport::udp}, {},
      [this, method, handler, left = left - timeout](const sd::CallResult& answer) {
        if (phase_ == Phase::over) {
          return;
        }
        if (!answer && answer.error().fault == sd::CallFault::timed_out && left > 0s) {
          ask(method, handler, left);
          return;
        }
        const auto status =
            answer ? someip::unpack<Status>(answer->payload) : tl::unexpected{someip::WireError::truncated};
        if (!status) {
          const bool answered = answer || answer.error().fault == sd::CallFault::error;
          end(answered ? "the service is not one of 'trestle perf server'" : "the service does not answer");
          return;
        }
        (this->*handler)(*status);
      });
}

void Client::compare_clocks() {
  asked_ns_ = monotonic_ns();
  ask(status_method, &Client::on_clock, options_.patience);
}

void Client::on_clock(const Status& status) {
  const std::int64_t now = monotonic_ns();
  const std::int64_t trip = now - asked_ns_;
  if (samples_ == 0 || trip < best_trip_ns_) {
    best_trip_ns_ = trip;
    offset_ns_ = static_cast<std::int64_t>(status.now_ns) - (asked_ns_ + trip / 2);
  }
  if (status.clock == own_status().clock) {
    offset_ns_ = 0;
  } else if (++samples_ < clock_samples) {
    compare_clocks();
    return;
  } else {
    result_.clock_error_ns = best_trip_ns_ / 2;
  }
  begin();
}

void Client::begin() {
  if (options_.events) {
    start_events();
  } else {
    call();
  }
}

void Client::start_events() {
  const auto payload = someip::pack(options_.plan);
  const ByteView bytes{payload};
  node_.call(service_, {.method = start_method, .timeout = options_.patience, .transport = Transport::udp},
             {&bytes, 1}, [this](const sd::CallResult& answer) {
               if (phase_ != Phase::preparing) {
                 return;  // an event came first
               }
               if (!answer && answer.error().code == someip::ReturnCode::not_ready) {
                 after(pause, &Client::start_events);  // the subscription is not complete yet
               } else if (!answer) {
                 end("the service does not take the plan for its events");
               }
             });
}

void Client::call() {
  const sd::CallSpec spec{.method = echo_method,
                          .timeout = options_.patience,
                          .transport = options_.plan.tcp ? Transport::tcp : Transport::udp,
                          .pacing = pacing_of(options_.plan)};
  const ByteView bytes{request_};
  node_.call(service_, spec, {&bytes, 1},
             [this, called = monotonic_ns()](const sd::CallResult& answer) { on_answer(called, answer); });
}

void Client::on_answer(std::int64_t called_ns, const sd::CallResult& answer) {
  if (phase_ == Phase::preparing) {
    if (answer) {
      // The path works: warm up with the full number of calls.
      phase_ = Phase::warming_up;
      after(options_.warm_up, &Client::tick);
      for (std::uint32_t i = 1; i < options_.in_flight; ++i) {
        call();
      }
    } else {
      after(pause, &Client::call);  // a TCP connection takes some time
      return;
    }
  }
  if (phase_ == Phase::measuring && called_ns >= began_ns_) {
    if (answer && answer->payload.size() == request_.size()) {
      result_.latency.add(monotonic_ns() - called_ns);
      ++result_.received;
    } else if (answer || answer.error().fault == sd::CallFault::error) {
      ++result_.failed;
    } else {
      ++result_.lost;
    }
  }
  if (phase_ == Phase::warming_up || phase_ == Phase::measuring) {
    call();
  }
}

void Client::on_event(const someip::Message& message) {
  const std::int64_t now = monotonic_ns();
  someip::ByteReader in{message.payload};
  const std::uint64_t sequence = in.u64();
  const auto sent = static_cast<std::int64_t>(in.u64());
  if (in.failed() || message.payload.size() != options_.plan.bytes) {
    if (phase_ == Phase::measuring) {
      ++result_.failed;
    }
    return;
  }
  if (const std::uint32_t window = options_.plan.window;
      window > 0 && ++since_acknowledged_ >= std::max(window / 4, 1U)) {
    since_acknowledged_ = 0;
    std::array<std::byte, 8> bytes;
    someip::ByteWriter out{bytes};
    out.u64(sequence);
    const ByteView payload{bytes};
    node_.send(service_, {.method = acknowledge_method, .transport = Transport::udp}, {&payload, 1});
  }
  if (phase_ == Phase::preparing) {
    phase_ = Phase::warming_up;
    after(options_.warm_up, &Client::tick);
  } else if (phase_ == Phase::measuring) {
    if (first_event_ == 0) {
      first_event_ = sequence;
    }
    if (sequence >= first_event_) {
      last_event_ = std::max(last_event_, sequence);
      ++result_.received;
      result_.latency.add(now - sent + offset_ns_);
    }
  }
}

void Client::tick() {
  if (phase_ == Phase::warming_up) {
    limit_.cancel();
    ask(status_method, &Client::start_measuring, options_.patience);
    return;
  }
  const auto left = std::chrono::nanoseconds{began_ns_ - monotonic_ns()} + options_.measured;
  if (left <= 0s) {
    stop_measuring();
    return;
  }
  update_counts();
  if (result_.seconds > 0 && progress_) {
    progress_(result_);
  }
  after(std::min<Duration>(left, 1s), &Client::tick);
}

void Client::start_measuring(const Status& status) {
  server_before_ = status;
  client_before_ = own_status();
  phase_ = Phase::measuring;
  began_ns_ = monotonic_ns();
  after(std::min<Duration>(options_.measured, 1s), &Client::tick);
}

void Client::update_counts() {
  result_.seconds = static_cast<double>((ended_ns_ != 0 ? ended_ns_ : monotonic_ns()) - began_ns_) / 1e9;
  if (options_.events && last_event_ != 0) {
    const std::uint64_t sent = last_event_ - first_event_ + 1;
    result_.lost = sent - std::min(sent, result_.received + result_.failed);
  }
  result_.sent = result_.received + result_.failed + result_.lost;
}

void Client::stop_measuring() {
  ended_ns_ = monotonic_ns();
  client_after_ = own_status();
  phase_ = Phase::stopping;
  ask(options_.events ? stop_method : status_method, &Client::finish, options_.patience);
}

void Client::finish(const Status& status) {
  update_counts();
  result_.cpu["client"] = cpu_between(client_before_, client_after_);
  result_.cpu["server"] = cpu_between(server_before_, status);
  const sd::NodeCounters counters = node_.counters();
  result_.counters = {{"overflowed", counters.overflowed},
                      {"malformed", counters.malformed},
                      {"unexpected", counters.unexpected}};
  if (options_.events) {
    result_.counters["dropped_by_server"] = status.dropped;
    // Includes a few events sent just before and after the measured time.
    result_.counters["sent_by_server"] = status.events - server_before_.events;
  }
  end(result_.received > 0 ? "" : options_.events ? "no event came" : "no call was answered");
}

void Client::end(const std::string& fault) {
  if (phase_ != Phase::over) {
    phase_ = Phase::over;
    timer_.cancel();
    limit_.cancel();
    done_(fault);
  }
}

void Client::after(Duration delay, void (Client::*what)()) {
  timer_.expires_after(delay);
  timer_.async_wait([this, what](const boost::system::error_code& error) {
    if (!error) {
      (this->*what)();
    }
  });
}

}  // namespace trestle::measure::perf
