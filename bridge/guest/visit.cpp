#include "bridge/guest/visit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <set>
#include <utility>

#include "sd/net/clock.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/wire/bytes.hpp"

namespace trestle::guest {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::chrono::milliseconds tick_period{50};
/// Of all that nobody names events of. Most events have these ids, and each costs memory.
constexpr std::uint16_t first_usual_event = 0x8001;
constexpr std::uint16_t last_usual_event = 0x8fff;
/// So many are asked for at once, and the next at the next tick: the bridge has other things to do.
constexpr std::uint16_t events_at_once = 512;
constexpr std::chrono::hours longest_call{1};
/// A frame has no more bytes beside its payload or message.
constexpr std::size_t most_overhead = 8192;

/// Why there is nobody to call, with other instances and versions of the service.
std::string nobody_offers(const sd::Node& node, const sd::Proxy& proxy, const Call& wish) {
  for (const sd::RemoteService& one : proxy.available()) {
    if (wish.transport && !(*wish.transport == Transport::tcp ? one.tcp : one.udp)) {
      const bool tcp = *wish.transport == Transport::tcp;
      return fmt::format("{} is offered over {}, and not over {}, over which this call goes",
                         sd::to_string(one.service, one.instance), tcp ? "UDP" : "TCP", tcp ? "TCP" : "UDP");
    }
  }
  std::set<std::string> others;
  for (const sd::SeenOffer& one : node.seen_offers()) {
    if (one.service == wish.service) {
      others.insert(fmt::format("{} version {}", sd::to_string(one.service, one.instance),
                                sd::version_text(one.major, one.minor)));
    }
  }
  return "nobody offers the service" +
         (others.empty() ? "" : fmt::format("; there is {}", fmt::join(others, ", ")));
}

}  // namespace

void Window::add(TimePoint now, std::size_t size) {
  if (now - began >= std::chrono::seconds{1}) {
    *this = {.began = now};
  }
  ++count;
  bytes += size;
}

bool Household::has_budget(TimePoint now, std::size_t bytes) {
  passed.add(now, bytes);
  return passed.count <= Host::most_events && passed.bytes <= Host::most_event_bytes;
}

void Visit::begin(const Hello& hello, bool may_stay) {
  began_ = sd::now();
  say(hello);
  tick_later();
  if (may_stay) {
    read_length();
  } else {
    refuse(household_->counters.guests_refused,
           fmt::format("the bridge serves {} tools at a time, and they are there", Host::most_guests));
  }
}

void Visit::end() {
  release();
  ticker_.cancel();
  error_code ignored;
  socket_.close(ignored);
}

/// Nothing is done for it any more.
void Visit::release() {
  if (node_ == nullptr) {
    return;
  }
  sd::Node& node = *std::exchange(node_, nullptr);
  proxies_.clear();
  sendings_.clear();
  for (const Subscribed& one : subscriptions_) {
    for (const sd::SubscriptionId id : one.ids) {
      node.unsubscribe(id);
    }
  }
  subscriptions_.clear();
  for (const sd::RequirementId id : requirements_) {
    node.release(id);
  }
  requirements_.clear();
}

// --- What comes from the guest ----------------------------------------------------------------------------

void Visit::read_length() {
  asio::async_read(
      socket_, asio::buffer(length_), [self = shared_from_this()](error_code error, std::size_t) {
        const std::size_t size = someip::load<std::uint32_t>(self->length_.data());
        if (error) {
          self->end();
        } else if (self->is_served() && size > most_frame_bytes) {
          self->refuse_frame(fmt::format("a request has at most {} bytes, not {}", most_frame_bytes, size));
        } else if (self->is_served()) {
          self->read_body(size);
        }
      });
}

void Visit::read_body(std::size_t size) {
  body_.resize(size);
  asio::async_read(socket_, asio::buffer(body_), [self = shared_from_this()](error_code error, std::size_t) {
    if (error) {
      self->end();
    } else if (self->is_served()) {
      const std::optional<Frame> frame = decode(std::exchange(self->body_, {}));
      if (frame) {
        self->on_frame(*frame);
      } else {
        self->refuse_frame("the bridge does not understand the request: is the tool of the same version?");
      }
      if (self->is_served()) {
        self->read_length();
      }
    }
  });
}

void Visit::on_frame(Frame frame) {
  if (++requests_ > Host::most_requests) {
    refuse(household_->counters.requests_refused,
           fmt::format("the bridge does no more than {} things for a tool", Host::most_requests));
    return;
  }
  ++household_->counters.requests;
  try {
    if (const auto* const find = std::get_if<Find>(&frame)) {
      on_request(*find);
    } else if (auto* const call = std::get_if<Call>(&frame)) {
      on_request(std::move(*call));
    } else if (const auto* const subscribe = std::get_if<Subscribe>(&frame)) {
      on_request(*subscribe);
    } else {
      refuse_frame("the bridge was told what only a bridge tells");
    }
  } catch (const std::exception& error) {  // what a Node refuses
    refuse(household_->counters.requests_refused, error.what());
  }
}

void Visit::on_request(const Find& wish) {
  const sd::RequirementId id =
      node_->require({.service = wish.service, .instance = wish.instance, .major = sd::any_major},
                     [weak = weak_from_this()](const sd::RemoteService& service, bool available) {
                       const auto self = weak.lock();
                       if (self && available) {
                         self->say_if_room(Found{service});
                       }
                     });
  requirements_.push_back(id);
  for (const sd::RemoteService& one : node_->available(id)) {
    say_if_room(Found{one});
  }
}

void Visit::on_request(Call wish) {
  const Duration timeout =
      std::min<Duration>(std::chrono::milliseconds{wish.timeout_ms}, Duration{longest_call});
  std::vector<std::byte> payload = std::exchange(wish.payload, {});
  sd::Proxy& proxy = proxies_.emplace_back(
      *node_, sd::RequireSpec{.service = wish.service, .instance = wish.instance, .major = wish.major});
  if (wish.forget) {
    auto bytes = std::make_shared<const std::vector<std::byte>>(std::move(payload));
    sendings_.push_back({&proxy, std::move(wish), std::move(bytes), sd::now() + timeout});
    send_waiting();
    return;
  }
  const sd::CallSpec call{.method = wish.method, .timeout = timeout, .transport = wish.transport};
  proxy.call(call, std::move(payload),
             [weak = weak_from_this(), &proxy, wish = std::move(wish)](error_code error,
                                                                       const sd::Response& response) {
               const auto self = weak.lock();
               if (self && self->is_served()) {
                 self->on_response(proxy, wish, error, response);
               }
             });
}

void Visit::on_response(const sd::Proxy& proxy, const Call& wish, error_code error,
                        const sd::Response& response) {
  Answer answer;
  answer.is_answer = !error || response.header.return_code != someip::ReturnCode::ok;
  if (error == sd::CallFault::unavailable) {
    answer.fault = nobody_offers(*node_, proxy, wish);
  } else if (error) {
    answer.fault = error.message();
  }
  if (response.payload.size() + most_overhead > most_frame_bytes) {
    answer = {.fault = fmt::format("the answer has {} bytes, and a bridge hands on {}",
                                   response.payload.size(), most_frame_bytes - most_overhead)};
  } else if (answer.is_answer) {
    answer.message.resize(someip::header_bytes + response.payload.size());
    static_cast<void>(someip::encode(response.header, response.payload, answer.message));  // there is room
  }
  say(answer);
}

void Visit::on_request(const Subscribe& wish) {
  if (wish.events.empty() && std::exchange(usual_events_, true)) {
    refuse(household_->counters.requests_refused,
           "a tool subscribes to one eventgroup without names of its events");
    return;
  }
  if (wish.instance == someip::any_instance) {  // which may be very many, and the routes need places, too
    refuse(household_->counters.requests_refused, "a tool subscribes to one instance");
    return;
  }
  sd::SubscribeSpec spec{.service = wish.service,
                         .instance = wish.instance,
                         .major = wish.major,
                         .eventgroup = wish.eventgroup,
                         .udp = wish.udp,
                         .tcp = wish.tcp};
  if (const std::string fault = household_->judge(spec); !fault.empty()) {
    refuse(household_->counters.requests_refused, fault);
    return;
  }
  Subscribed& one = subscriptions_.emplace_back();
  one.spec = std::move(spec);
  if (wish.events.empty()) {
    one.next_usual = first_usual_event;
    subscribe_to_more(one);
  } else {
    one.next_usual = last_usual_event + 1U;
    subscribe(one, wish.events);
  }
}

void Visit::subscribe_to_more(Subscribed& one) {
  std::vector<someip::MethodId> events;
  while (one.next_usual <= last_usual_event && events.size() < events_at_once) {
    events.push_back(someip::MethodId{static_cast<std::uint16_t>(one.next_usual++)});
  }
  if (!events.empty()) {
    subscribe(one, std::move(events));
  }
}

void Visit::subscribe(Subscribed& one, std::vector<someip::MethodId> events) {
  sd::SubscribeSpec spec = one.spec;
  spec.events = std::move(events);
  one.ids.push_back(
      node_->subscribe(spec, [weak = weak_from_this()](const someip::Message& message, const Endpoint& from) {
        if (const auto self = weak.lock()) {
          self->on_event(message, from);
        }
      }));
}

void Visit::on_event(const someip::Message& message, const Endpoint& from) {
  if (!is_served()) {
    return;
  }
  HostCounters& counters = household_->counters;
  const TimePoint now = sd::now();
  arrived_.add(now, message.size());
  if (arrived_.count > Host::far_too_many * Host::most_events ||
      arrived_.bytes > Host::far_too_many * Host::most_event_bytes) {
    too_fast_ = true;  // ended by the next tick, as this is in the middle of what the Node does
  }
  if (too_fast_) {
    ++counters.events_too_many;
    return;
  }
  if (waiting_events_ >= Host::most_waiting_events ||
      waiting_.size() + message.size() + most_overhead > Host::most_waiting_bytes) {
    ++counters.events_unread;
    ++lost_;
    return;
  }
  if (!household_->has_budget(now, message.size())) {
    ++counters.events_too_many;
    ++lost_;
    return;
  }
  ++counters.events;
  ++waiting_events_;
  append_event(waiting_, message, from, std::exchange(lost_, 0));
  flush();
}

// --- What is due ------------------------------------------------------------------------------------------

void Visit::tick_later() {
  ticker_.expires_after(tick_period);
  ticker_.async_wait([weak = weak_from_this()](error_code error) {
    const auto self = weak.lock();
    if (self && !error && self->is_connected()) {
      self->tick();
      self->tick_later();
    }
  });
}

void Visit::tick() {
  const bool is_of_use = is_served() && requests_ > 0;
  if (!is_of_use && sd::now() - began_ > Host::patience) {
    end();
  }
  if (!is_served()) {
    return;
  }
  HostCounters& counters = household_->counters;
  if (too_fast_) {
    refuse(counters.ended_too_fast,
           fmt::format(
               "more than {} events or {} MB a second come: a bridge does not receive these for a tool",
               Host::far_too_many * Host::most_events, Host::far_too_many * Host::most_event_bytes >> 20U));
    return;
  }
  send_waiting();
  try {
    for (Subscribed& one : subscriptions_) {
      subscribe_to_more(one);
      tell_of(one);
    }
  } catch (const std::exception& error) {  // what a Node refuses
    refuse(counters.requests_refused, error.what());
    return;
  }
  if (lost_ > 0 && !writing_) {
    say(Event{.lost = std::exchange(lost_, 0)});
  }
}

void Visit::send_waiting() {
  const TimePoint now = sd::now();
  std::erase_if(sendings_, [&](const Sending& one) {
    const bool is_sent = one.proxy->send({.method = one.wish.method, .transport = one.wish.transport},
                                         *one.payload, one.payload);
    if (is_sent) {
      say(Answer{});
    } else if (now >= one.until) {
      say(Answer{.fault = nobody_offers(*node_, *one.proxy, one.wish)});
    }
    return is_sent || now >= one.until;
  });
}

void Visit::tell_of(Subscribed& one) {
  const std::string name =
      fmt::format("eventgroup {} of {}", sd::hexadecimal(someip::value(one.spec.eventgroup)),
                  sd::to_string(one.spec.service, one.spec.instance));
  const sd::SubscriptionId id = one.ids.front();
  if (const bool active = node_->subscribed(id); active != one.active) {
    one.active = active;
    say_if_room(Said{.text = (active ? "subscribed to " : "not subscribed any more to ") + name});
  }
  const sd::SubscriptionFaults told = std::exchange(one.faults, node_->subscription_faults(id));
  if (one.faults.refused != told.refused) {
    say_if_room(Said{.text = "the server refuses " + name});
  }
  if (one.faults.other_transport != told.other_transport) {
    say_if_room(Said{.text = name + " is wanted over TCP, but the service is not offered over TCP"});
  }
  if (one.faults.other_version != told.other_version) {
    say_if_room(Said{.text = name + " is wanted, but the service is offered in another version"});
  }
  const std::vector<someip::MethodId> others =
      one.others_told ? std::vector<someip::MethodId>{} : node_->other_events(id).ids;
  if (!others.empty()) {
    one.others_told = true;
    std::vector<std::string> ids;
    for (const someip::MethodId event : others) {
      ids.push_back(sd::hexadecimal(someip::value(event)));
    }
    say_if_room(Said{.text = fmt::format("other events come, too, which are printed when they are named: {}",
                                         fmt::join(ids, ", "))});
  }
}

// --- What goes to the guest -------------------------------------------------------------------------------

/// What comes at most once for each request.
void Visit::say(const Frame& frame) {
  const std::vector<std::byte> bytes = encode(frame);
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  flush();
}

/// What others of the network can bring about again and again.
void Visit::say_if_room(const Frame& frame) {
  if (!is_served()) {
    return;
  }
  if (waiting_.size() < Host::most_waiting_bytes) {
    say(frame);
  } else {
    ++household_->counters.lines_unread;
  }
}

/// It is told why, and left: when it has read that, or after a while.
void Visit::refuse(std::uint64_t& counter, const std::string& why) {
  ++counter;
  release();
  began_ = sd::now();
  say(Said{.is_end = true, .text = why});
}

void Visit::refuse_frame(const std::string& why) {
  refuse(household_->counters.frames_refused, why);
}

void Visit::flush() {
  if (writing_ || waiting_.empty() || !is_connected()) {
    return;
  }
  writing_ = true;
  sending_ = std::exchange(waiting_, {});
  waiting_events_ = 0;
  asio::async_write(socket_, asio::buffer(sending_),
                    [self = shared_from_this()](error_code error, std::size_t) {
                      self->writing_ = false;
                      self->sending_ = {};
                      if (error || (!self->is_served() && self->waiting_.empty())) {
                        self->end();
                      } else {
                        self->flush();
                      }
                    });
}

}  // namespace trestle::guest
