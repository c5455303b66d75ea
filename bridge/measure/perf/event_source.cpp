#include "bridge/measure/perf/event_source.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include "someip/net/message_sender.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::measure::perf {
namespace {

using namespace std::chrono_literals;

/// Events that are sent before other handlers run.
constexpr unsigned batch = 64;
/// Large events that may wait to be sent.
constexpr unsigned max_waiting = 4;
/// After this time without an acknowledgement, events under way are taken for lost.
constexpr Duration patience = 100ms;

}  // namespace

/// The parts of an event, kept as long as it waits.
struct EventSource::Event {
  Event(std::shared_ptr<EventSource> of, std::uint32_t of_round) : source{std::move(of)}, round{of_round} {}
  ~Event() { source->on_sent(round); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  std::shared_ptr<EventSource> source;
  std::uint32_t round;
  Front front{};
  std::shared_ptr<const std::vector<std::byte>> rest;
};

EventSource::EventSource(sd::Node& node, sd::OfferHandle offer)
    : node_{node}, offer_{offer}, due_timer_{node.io()}, patience_timer_{node.io()} {}

bool EventSource::start(const EventPlan& plan) {
  if (node_.subscribers(offer_, plan.tcp ? tcp_event : udp_event) == 0) {
    return false;
  }
  stop();
  plan_ = plan;
  rest_ = std::make_shared<const std::vector<std::byte>>(plan.bytes - min_event_bytes, std::byte{0x5a});
  events_ = 0;
  dropped_ = 0;
  acknowledged_ = 0;
  acknowledged_before_ = 0;
  events_before_ = 0;
  waiting_ = 0;
  due_ = std::chrono::steady_clock::now();
  if (plan.rate_hz > 0) {
    period_ = std::chrono::duration_cast<Duration>(std::chrono::duration<double>{1 / plan.rate_hz});
  }
  running_ = true;
  watch();
  pump_later();
  return true;
}

void EventSource::stop() {
  running_ = false;
  ++round_;
  due_timer_.cancel();
  patience_timer_.cancel();
}

void EventSource::acknowledge(std::uint64_t sequence) {
  if (sequence > acknowledged_ && sequence <= events_) {
    acknowledged_ = sequence;
    pump();
  }
}

void EventSource::fill(Front& front, TimePoint due_at) const {
  someip::ByteWriter out{front};
  out.u64(events_);
  out.u64(static_cast<std::uint64_t>(std::chrono::nanoseconds{due_at.time_since_epoch()}.count()));
}

void EventSource::send(TimePoint due_at) {
  ++events_;
  const someip::MethodId event = plan_.tcp ? tcp_event : udp_event;
  const someip::TpPacing pacing = pacing_of(plan_);
  sd::Notified notified;
  if (plan_.bytes <= someip::max_plain_payload_bytes) {
    Front front;
    fill(front, due_at);
    const std::array<ByteView, 2> payload{front, *rest_};
    notified = node_.notify(offer_, event, payload, nullptr, pacing);
  } else {
    const auto kept = std::make_shared<Event>(shared_from_this(), round_);
    ++waiting_;
    kept->rest = rest_;
    fill(kept->front, due_at);
    const std::array<ByteView, 2> payload{kept->front, *kept->rest};
    notified = node_.notify(offer_, event, payload, kept, pacing);
  }
  dropped_ += notified.dropped > 0 ? 1 : 0;
}

void EventSource::on_sent(std::uint32_t of_round) {
  if (of_round == round_) {
    --waiting_;
    pump_later();
  }
}

bool EventSource::has_room() const {
  return running_ && (plan_.window == 0 || events_ - acknowledged_ < plan_.window) && waiting_ < max_waiting;
}

void EventSource::pump() {
  for (unsigned i = 0; i < batch; ++i) {
    if (!has_room()) {
      return;  // called again by an acknowledgement, or when an event stops waiting
    }
    const TimePoint now = std::chrono::steady_clock::now();
    if (plan_.rate_hz > 0) {
      if (now < due_) {
        due_timer_.expires_at(due_);
        due_timer_.async_wait([self = shared_from_this()](const boost::system::error_code& error) {
          if (!error) {
            self->pump();
          }
        });
        return;
      }
      // After a stall all due events are sent; their latency includes the stall.
      send(due_);
      due_ += period_;
    } else {
      send(now);
    }
  }
  pump_later();
}

void EventSource::pump_later() {
  if (running_ && !posted_) {
    posted_ = true;
    boost::asio::post(node_.io(), [self = shared_from_this()] {
      self->posted_ = false;
      self->pump();
    });
  }
}

void EventSource::watch() {
  patience_timer_.expires_after(patience);
  patience_timer_.async_wait([self = shared_from_this()](const boost::system::error_code& error) {
    if (!error && self->running_) {
      self->look();
    }
  });
}

void EventSource::look() {
  if (node_.subscribers(offer_, plan_.tcp ? tcp_event : udp_event) == 0) {
    running_ = false;  // the client is gone
    return;
  }
  if (acknowledged_ == acknowledged_before_ && events_ == events_before_) {
    acknowledged_ = events_;
    pump_later();
  }
  acknowledged_before_ = acknowledged_;
  events_before_ = events_;
  watch();
}

}  // namespace trestle::measure::perf
