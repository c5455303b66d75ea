#include "bridge/measure/perf/event_source.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <vector>

#include "someip/net/message_sender.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::measure::perf {
namespace {

namespace asio = boost::asio;
using namespace std::chrono_literals;

/// Events that are sent before other handlers run.
constexpr unsigned batch = 64;
/// Large events that may wait to be sent.
constexpr unsigned max_waiting = 4;
/// After this time without an acknowledgement, events under way are taken for lost.
constexpr Duration patience = 100ms;

}  // namespace

struct EventSource::State : std::enable_shared_from_this<State> {
  State(sd::Node& on, sd::OfferHandle of)
      : node{&on}, offer{of}, due_timer{on.io()}, patience_timer{on.io()} {}

  /// The parts of an event, kept as long as it waits.
  struct Event {
    Event(std::shared_ptr<State> of, std::uint32_t of_round) : source{std::move(of)}, round{of_round} {}
    ~Event() { source->on_sent(round); }
    Event(const Event&) = delete;
    Event& operator=(const Event&) = delete;

    std::shared_ptr<State> source;
    std::uint32_t round;
    std::array<std::byte, min_event_bytes> front{};
    std::shared_ptr<const std::vector<std::byte>> rest;
  };

  void fill(std::array<std::byte, min_event_bytes>& front, TimePoint due_at) const {
    someip::ByteWriter out{front};
    out.u64(events);
    out.u64(static_cast<std::uint64_t>(std::chrono::nanoseconds{due_at.time_since_epoch()}.count()));
  }

  /// @param due_at  the time from which its latency counts.
  void send(TimePoint due_at) {
    ++events;
    const someip::MethodId event = plan.tcp ? tcp_event : udp_event;
    const someip::TpPacing pacing = pacing_of(plan);
    sd::Notified notified;
    if (plan.bytes <= someip::max_plain_payload_bytes) {
      std::array<std::byte, min_event_bytes> front;
      fill(front, due_at);
      const std::array<ByteView, 2> payload{front, *rest};
      notified = node->notify(offer, event, payload, nullptr, pacing);
    } else {
      const auto kept = std::make_shared<Event>(shared_from_this(), round);
      ++waiting;
      kept->rest = rest;
      fill(kept->front, due_at);
      const std::array<ByteView, 2> payload{kept->front, *kept->rest};
      notified = node->notify(offer, event, payload, kept, pacing);
    }
    dropped += notified.dropped > 0 ? 1 : 0;
  }

  void on_sent(std::uint32_t of_round) {
    if (of_round == round) {
      --waiting;
      pump_later();
    }
  }

  [[nodiscard]] bool has_room() const {
    return running && (plan.window == 0 || events - acknowledged < plan.window) && waiting < max_waiting;
  }

  void pump() {
    for (unsigned i = 0; i < batch; ++i) {
      if (!has_room()) {
        return;  // called again by an acknowledgement, or when an event stops waiting
      }
      const TimePoint now = std::chrono::steady_clock::now();
      if (plan.rate_hz > 0) {
        if (now < due) {
          due_timer.expires_at(due);
          due_timer.async_wait([self = shared_from_this()](const boost::system::error_code& error) {
            if (!error) {
              self->pump();
            }
          });
          return;
        }
        // After a stall all due events are sent; their latency includes the stall.
        send(due);
        due += period;
      } else {
        send(now);
      }
    }
    pump_later();
  }

  void pump_later() {
    if (running && !posted) {
      posted = true;
      asio::post(node->io(), [self = shared_from_this()] {
        self->posted = false;
        self->pump();
      });
    }
  }

  void watch() {
    patience_timer.expires_after(patience);
    patience_timer.async_wait([self = shared_from_this()](const boost::system::error_code& error) {
      if (!error && self->running) {
        self->look();
      }
    });
  }

  void look() {
    if (node->subscribers(offer, plan.tcp ? tcp_event : udp_event) == 0) {
      running = false;  // the client is gone
      return;
    }
    if (acknowledged == acknowledged_before && events == events_before) {
      acknowledged = events;
      pump_later();
    }
    acknowledged_before = acknowledged;
    events_before = events;
    watch();
  }

  sd::Node* node;
  sd::OfferHandle offer;
  EventPlan plan{};
  std::shared_ptr<const std::vector<std::byte>> rest;
  bool running = false;
  bool posted = false;
  std::uint32_t round = 0;  ///< of start()
  std::uint64_t events = 0;
  std::uint64_t dropped = 0;
  std::uint64_t acknowledged = 0;  ///< sequence number
  unsigned waiting = 0;
  Duration period{};
  TimePoint due;
  asio::steady_timer due_timer;
  std::uint64_t acknowledged_before = 0;
  std::uint64_t events_before = 0;
  asio::steady_timer patience_timer;
};

EventSource::EventSource(sd::Node& node, sd::OfferHandle offer)
    : state_{std::make_shared<State>(node, offer)} {}

EventSource::~EventSource() {
  stop();
}

bool EventSource::start(const EventPlan& plan) {
  State& state = *state_;
  if (state.node->subscribers(state.offer, plan.tcp ? tcp_event : udp_event) == 0) {
    return false;
  }
  stop();
  state.plan = plan;
  state.rest = std::make_shared<const std::vector<std::byte>>(plan.bytes - min_event_bytes, std::byte{0x5a});
  state.events = 0;
  state.dropped = 0;
  state.acknowledged = 0;
  state.acknowledged_before = 0;
  state.events_before = 0;
  state.waiting = 0;
  state.due = std::chrono::steady_clock::now();
  if (plan.rate_hz > 0) {
    state.period = std::chrono::duration_cast<Duration>(std::chrono::duration<double>{1 / plan.rate_hz});
  }
  state.running = true;
  state.watch();
  state.pump_later();
  return true;
}

void EventSource::stop() {
  state_->running = false;
  ++state_->round;
  state_->due_timer.cancel();
  state_->patience_timer.cancel();
}

void EventSource::acknowledge(std::uint64_t sequence) {
  State& state = *state_;
  if (sequence > state.acknowledged && sequence <= state.events) {
    state.acknowledged = sequence;
    state.pump();
  }
}

std::uint64_t EventSource::events() const noexcept {
  return state_->events;
}
std::uint64_t EventSource::dropped() const noexcept {
  return state_->dropped;
}

}  // namespace trestle::measure::perf
