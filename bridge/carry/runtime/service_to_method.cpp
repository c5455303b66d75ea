#include "bridge/carry/runtime/make_routes.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/error.hpp>
#include <memory>
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/call_shares.hpp"
#include "bridge/carry/runtime/calm_updates.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/loop_guard.hpp"
#include "bridge/carry/runtime/loop_suspects.hpp"
#include "bridge/carry/runtime/route_meter.hpp"
#include "bridge/carry/runtime/service_work.hpp"
#include "bridge/messages/values/byte_text.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

// What went wrong is the code of an answer.
bool is_return_code(const boost::system::error_code& error) {
  return error && error.category() == make_error_code(someip::ReturnCode::not_ok).category();
}

// Whether the server has certainly not done what it was asked for. These two codes are what another bridge
// says of a ROS server that may have begun.
bool is_certain(const boost::system::error_code& error) {
  return error != sd::CallFault::timed_out && error != someip::ReturnCode::timeout &&
         error != someip::ReturnCode::not_reachable;
}

CallerKey client_of(const dds::RequestId& id) {
  return dds::participant_of(id.request.writer);
}

// As the log has peers that are found.
std::string hex_of_participant(const dds::RequestId& id) {
  std::string digits;
  messages::append_hex(digits, dds::participant_of(id.request.writer));
  return digits;
}

// Whether a refused value is answered with one that the server has told before.
bool keeps_value(const MethodRoute& method) {
  return method.access == messages::FieldAccess::set && !method.getter;
}

std::vector<sd::E2eSpec> protection(const MethodRoute& method) {
  std::vector<sd::E2eSpec> specs;
  if (method.e2e) {
    specs.push_back(called(method.method, *method.e2e, !method.fire_and_forget));
  }
  if (method.getter && method.getter->e2e) {
    specs.push_back(called(method.getter->id, *method.getter->e2e, true));
  }
  return specs;
}

/// A method as a ROS service: requests of ROS clients are converted, put to the SOME/IP service, and answered
/// with what that answers. The ROS service is there only while the SOME/IP service is; one by which another
/// bridge offers the very ROS service is none. On the thread that runs the io_context. docs/services.md tells
/// what becomes of calls that go wrong.
class ServiceToMethod final : public RunningRoute, private CallEnds {
 public:
  /// @param context  outlives the route.
  ServiceToMethod(const RouteContext& context, const MethodRoute& method, MethodParts parts)
      : RunningRoute{method.e2e},
        context_{context},
        method_{method},
        suspects_{dds::ros_request_topic(method.ros_service), true},
        plans_{std::move(parts.plans)},
        ros_{suspects_.watching(std::move(parts.ros))},
        log_{context.clock, method.ros_service},
        failure_{std::move(parts.failure)},
        returns_{dds::ros_request_topic(method.ros_service), mark_of(context.address, method)},
        loop_{context.clock, method.ros_service, limits_of_calls},
        work_{std::make_shared<ServiceWork>(
            context,
            [this](dds::TimePoint now) {
              if (server_) {
                server_->work(now);
              }
            },
            [this] { return server_ ? server_->deadline() : std::nullopt; })},
        shares_{method.max_calls},
        updates_{context.clock, [this] { return update(); }} {
    if (method.notifier && context.values != nullptr) {
      context.values->tell(method.service, method.instance, *method.notifier,
                           [this](std::optional<ByteView> value) { note_value(value); });
    }
  }

  ~ServiceToMethod() override { ServiceToMethod::stop(); }

  /// Looks for the SOME/IP service; when it is there the ROS service begins.
  void join_someip() override {
    proxy_ = context_.someip->client(sd::RequireSpec{.service = method_.service,
                                                     .instance = method_.instance,
                                                     .major = method_.major,
                                                     .minor = method_.minor,
                                                     .e2e = protection(method_)},
                                     [this](const sd::RemoteService&, bool available) {
                                       if (!available) {
                                         value_.reset();
                                       }
                                       updates_.look_soon();
                                     });
  }

  /// Nothing is called any more, and the ROS service ends.
  void stop() override {
    stopped_ = true;
    alive_.reset();  // nobody is told how the calls end that are still outstanding
    work_->stop();
    if (server_) {
      past_ += server_->counters();
      server_.reset();
    }
  }

  void writers_changed() override {
    if (!stopped_ && returns_.update(*context_.dds)) {
      updates_.look_soon();
    }
  }

  [[nodiscard]] CounterGroup counters() const override {
    using enum someip::CounterKind;
    dds::ServiceServerCounters ros = past_;
    if (server_) {
      ros += server_->counters();
    }
    CounterGroup group{"ROS service of method " + method_.ros_service,
                       {{"received", received_},
                        {"answered", answered_},
                        {"refused", refused_},
                        {"failures_answered", failures_answered_},
                        {"in_flight", outstanding_, now},
                        {"ready", ready() ? 1U : 0U, now},
                        {"not_convertible", not_convertible_, loss},
                        {"too_large", too_large_, loss},
                        {"looped", loop_.looped(), loss},
                        {"too_many", too_many_, loss},
                        {"over_share", over_share_, loss},
                        {"unavailable", unavailable_, loss},
                        {"timed_out", timed_out_, loss},
                        {"not_sent", not_sent_, loss},
                        {"errors", errors_, loss},
                        {"answers_not_convertible", answers_not_convertible_, loss},
                        {"ended", ended_, loss}},
                       labels_of(picture_of(method_))};
    ros.for_each_counter(into(group));
    append_e2e(group, e2e_);
    return group;
  }

  [[nodiscard]] RoutePicture picture(const Surroundings& around) const override {
    RoutePicture result = picture_of(method_);
    result.someip.offers = pictures_of(around.offers_of(method_.service));
    result.dds.open = ready();
    result.received = received_;
    result.carried = answered_;
    result.in_use = static_cast<std::uint32_t>(outstanding_);
    meter_.fill(result, context_.clock);
    return result;
  }

  /// Its state is OK while the SOME/IP service is there.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool /*all*/) const override {
    const std::string at = called_id(method_.service, method_.instance, method_.method);
    diagnoses.push_back(method_state(counters(), ready(), "the SOME/IP service is not offered", at));
    append_checks(diagnoses, "answers to " + method_.ros_service, at);
  }

 private:
  /// The value that the field has, as its notifier tells; nothing: not known any more.
  void note_value(std::optional<ByteView> value) {
    if (value) {
      value_.emplace(value->begin(), value->end());
    } else {
      value_.reset();
    }
  }

  /// Whether the SOME/IP service is there, and with it the ROS service.
  [[nodiscard]] bool ready() const noexcept { return server_ != nullptr; }
  /// Has the ROS service begin or end, when the SOME/IP service has. Returns whether it did.
  bool update() {
    if (stopped_) {
      return false;
    }
    const bool wanted = look_for_servers();
    if (wanted == ready()) {
      return false;
    }
    if (!wanted) {
      past_ += server_->counters();
      server_.reset();
      spdlog::info("ROS service {}: ended, as the SOME/IP service has", method_.ros_service);
      tell_change();
      return true;
    }
    try {
      server_ = context_.dds->server(
          ros_, work_->waker(),
          [this](const dds::RequestId& id, const dds::ServiceMessage& request) { on_request(id, request); });
      spdlog::info("ROS service {}: begun, as the SOME/IP service is there", method_.ros_service);
      tell_change();
    } catch (const std::exception& error) {
      spdlog::error("ROS service {}: {}", method_.ros_service, error.what());
    }
    return true;
  }

  /// Looks for servers that are not ourselves by way of another bridge.
  [[nodiscard]] bool look_for_servers() {
    chosen_.reset();
    called_.clear();
    returns_.update(*context_.dds);
    bool any = false;
    bool all = true;
    std::optional<someip::InstanceId> first;
    for (const sd::RemoteService& server : proxy_->available()) {
      if (method_.transport && !(*method_.transport == Transport::tcp ? server.tcp : server.udp)) {
        continue;
      }
      const auto& at = server.udp ? server.udp : server.tcp;
      if (at && returns_.has(at->address)) {
        all = false;
        if (!std::exchange(told_returns_, true)) {
          spdlog::warn(
              "ROS service {}: the SOME/IP service at {} is not called for it: the bridge there calls this "
              "very "
              "ROS service",
              method_.ros_service, someip::to_string(at->address));
        }
        continue;
      }
      any = true;
      if (at) {
        called_.push_back(at->address);
      }
      first = first ? first : server.instance;
    }
    if (!all) {
      chosen_ = first;
    }
    return any;
  }

  /// The sender of a request, for the LoopGuard; nothing: one that may be part of a ring.
  // Behind a bridge there are many senders. A client at the host of the SOME/IP service may be one, too, that
  // does not say so; its calls of a ring come while the one that causes them waits for its answer.
  [[nodiscard]] std::optional<std::uint64_t> sender_of(const dds::RequestId& id) {
    suspects_.update(*context_.dds);
    if (id.from_bridge ||
        ((outstanding_ > 0 || method_.fire_and_forget) && suspects_.is_at(id.request.writer, called_))) {
      return std::nullopt;
    }
    return message_hash(id.request.writer);
  }

  void on_request(const dds::RequestId& id, const dds::ServiceMessage& request) {
    ++received_;
    meter_.came(context_.clock.now());
    const auto through = [&] {
      const auto suspected = std::ranges::find_if(called_, [&](const IpAddress& host) {
        return suspects_.is_at(id.request.writer, {&host, 1});
      });
      return suspected == called_.end()
                 ? "who else answers " + method_.ros_service
                 : fmt::format("{}, which calls it, and the SOME/IP service at {}",
                               suspects_.name_at(*suspected, *context_.dds), someip::to_string(*suspected));
    };
    if (!loop_.may_carry(message_hash(request.cdr()), sender_of(id), context_.clock.now(), through)) {
      loop_.arm();
      fail(id, "this route seems to loop", true);
      return;
    }
    if (method_.fire_and_forget) {
      if (const auto payload = payload_of(id, request)) {
        tell(id, *payload);
      }
      return;
    }
    // Before the conversion: who asks without end is to cost little.
    if (!takes_place(id)) {
      return;
    }
    auto payload = payload_of(id, request);
    if (!payload) {
      give_place_back(id);
      return;
    }
    std::vector<std::byte> wanted = keeps_value(method_) ? *payload : std::vector<std::byte>{};
    proxy_->call({.method = method_.method,
                  .timeout = method_.timeout,
                  .transport = method_.transport,
                  .instance = chosen_,
                  .pacing = method_.tp},
                 std::move(*payload), ends(), {.id = id, .wanted = std::move(wanted)});
  }

  /// Whether a call may wait for its answer; it does, then. If not, it is refused.
  [[nodiscard]] bool takes_place(const dds::RequestId& id) {
    const bool has_room = outstanding_ < method_.max_calls;
    // Asked in any case: a client that is refused counts among those that want a share.
    const bool may_wait = shares_.take(client_of(id), context_.clock.now());
    if (has_room && may_wait) {
      ++outstanding_;
      return true;
    }
    if (may_wait) {
      shares_.give_back(client_of(id));
    }
    if (has_room) {
      ++over_share_;
      fail(id,
           fmt::format("participant {} has its share of `max_calls`, {} of {} wait", hex_of_participant(id),
                       outstanding_, method_.max_calls),
           true);
    } else {
      ++too_many_;
      fail(id, "as many as `max_calls` wait for an answer", true);
    }
    return false;
  }

  void give_place_back(const dds::RequestId& id) {
    --outstanding_;
    shares_.give_back(client_of(id));
  }

  /// The request in SOME/IP; nothing: it was refused.
  std::optional<std::vector<std::byte>> payload_of(const dds::RequestId& id,
                                                   const dds::ServiceMessage& request) {
    const auto converted = plans_.request.cdr_to_someip(request.cdr(), scratch_);
    if (!converted) {
      ++not_convertible_;
      fail(id, "the request cannot be converted: " + in_words(converted.error(), request.cdr()), true);
      return std::nullopt;
    }
    if (converted->bytes > method_.tp.max_message) {
      ++too_large_;
      fail(id, "the request is larger than `max_message`", true);
      return std::nullopt;
    }
    return joined(*converted);
  }

  // ROS clients wait for an answer also where the method has none: they get the defaults of the response.
  void tell(const dds::RequestId& id, const std::vector<std::byte>& payload) {
    if (!proxy_->send({.method = method_.method,
                       .transport = method_.transport,
                       .instance = chosen_,
                       .pacing = method_.tp},
                      payload)) {
      ++not_sent_;
      fail(id, "the request could not be sent", true);
      return;
    }
    reply(id, {});
  }

  void on_response(const Caller& caller, boost::system::error_code error,
                   const sd::Response& response) override {
    give_place_back(caller.id);
    if (!caller.refusal.empty()) {
      on_value(caller, error, response);
      return;
    }
    const dds::RequestId& id = caller.id;
    if (e2e_ && response.check) {
      e2e_->note(*response.check);
      if (!e2e_->passes()) {
        fail(id, fmt::format("the answer fails its end-to-end check: {}", to_string(response.check->status)),
             false);
        return;
      }
    }
    if (!error) {
      if (keeps_value(method_) && response.payload.size() <= method_.tp.max_message) {
        value_ = response.payload;
      }
      reply(id, response.payload);
      return;
    }
    if (method_.access == messages::FieldAccess::set && is_return_code(error) &&
        (method_.getter || is_certain(error))) {
      on_refused(id, caller.wanted, error);
      return;
    }
    ++(error == sd::CallFault::unavailable || error == sd::CallFault::not_connected ? unavailable_
       : error == sd::CallFault::timed_out                                          ? timed_out_
       : error == sd::CallFault::not_sent                                           ? not_sent_
       : error == sd::CallFault::too_many_calls                                     ? too_many_
                                                                                    : errors_);
    fail(id,
         fmt::format("{} of SOME/IP service {}", error.message(),
                     called_id(method_.service, method_.instance, method_.method)),
         is_certain(error));
  }

  /// The server did not take a value: what it has is the answer.
  void on_refused(const dds::RequestId& id, ByteView wanted, const boost::system::error_code& why) {
    const std::string refusal = fmt::format("a value was refused: {} of SOME/IP service {}", why.message(),
                                            called_id(method_.service, method_.instance, method_.method));
    if (method_.getter) {
      ask_getter(id, refusal);
      return;
    }
    // Without a notifier it is what the setter answered last. Others may have changed it since: an answer
    // that is the value which was refused would say that it was taken.
    if (value_ && (method_.notifier || !std::ranges::equal(*value_, wanted))) {
      ++refused_;
      log_.tell(refusal + "; answered with the one that it had last");
      reply(id, *value_);
      return;
    }
    ++errors_;
    fail(id, refusal + ", and which it has is not known", true);
  }

  [[nodiscard]] std::weak_ptr<CallEnds> ends() { return std::shared_ptr<CallEnds>{alive_, this}; }

  void ask_getter(const dds::RequestId& id, const std::string& refusal) {
    ++outstanding_;
    shares_.take_over(client_of(id));
    proxy_->call({.method = method_.getter->id,
                  .timeout = method_.timeout,
                  .transport = method_.transport,
                  .instance = chosen_},
                 {}, ends(), {.id = id, .refusal = refusal});
  }

  /// What the getter says.
  void on_value(const Caller& caller, const boost::system::error_code& error, const sd::Response& value) {
    if (error) {
      ++errors_;
      fail(caller.id,
           fmt::format("{}, and which it has the getter does not say: {}", caller.refusal, error.message()),
           true);
      return;
    }
    ++refused_;
    log_.tell(caller.refusal + "; answered with the one that it has");
    reply(caller.id, value.payload);
  }

  void reply(const dds::RequestId& id, ByteView payload) {
    if (!server_) {
      ++ended_;
      return;
    }
    const auto sample = plans_.response.someip_to_cdr(payload, scratch_);
    if (!sample) {
      ++answers_not_convertible_;
      fail(id, "the answer cannot be converted: " + in_words(sample.error(), payload, method_.rules.payload),
           false);
      return;
    }
    ++answered_;
    meter_.carried(context_.clock.now(), payload.size());
    send(id, sample->slices);
  }

  /// Logs what went wrong, and has it answered where the type can say so.
  void fail(const dds::RequestId& id, const std::string& why, bool is_certain) {
    const auto sample = failure_ && server_ ? failure_->sample(why, is_certain) : std::nullopt;
    log_.tell(sample ? fmt::format("a call went wrong: {}", why)
                     : fmt::format("a call went wrong, and its ROS client gets no answer: {}", why));
    if (sample) {
      ++failures_answered_;
      const ByteView bytes{*sample};
      send(id, {&bytes, 1});
    }
  }

  void send(const dds::RequestId& id, std::span<const ByteView> sample) {
    server_->reply(id, sample, context_.clock.now());
    work_->arm();
  }

  const RouteContext& context_;
  const MethodRoute method_;
  LoopSuspects suspects_;  ///< ROS clients
  messages::ServicePlans plans_;
  const dds::ServiceConfig ros_;
  messages::ConversionScratch scratch_;
  ConversionLog log_;
  const std::optional<FailureReply> failure_;
  /// Of the field, if it is a setter that has no getter to ask.
  std::optional<std::vector<std::byte>> value_;
  Returns returns_;
  std::optional<someip::InstanceId> chosen_;  ///< where not all servers may be called
  bool told_returns_ = false;
  std::vector<IpAddress> called_;  ///< where the servers are
  LoopGuard loop_;
  std::shared_ptr<ServiceWork> work_;
  dds::ServiceServerCounters past_;  ///< of servers that have ended
  RouteMeter meter_;
  std::uint64_t received_ = 0;
  std::uint64_t answered_ = 0;
  std::size_t outstanding_ = 0;
  CallShares shares_;  ///< of those
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
  std::uint64_t too_many_ = 0;
  std::uint64_t over_share_ = 0;
  std::uint64_t unavailable_ = 0;
  std::uint64_t timed_out_ = 0;
  std::uint64_t not_sent_ = 0;
  std::uint64_t errors_ = 0;
  std::uint64_t refused_ = 0;
  std::uint64_t failures_answered_ = 0;
  std::uint64_t answers_not_convertible_ = 0;
  std::uint64_t ended_ = 0;
  bool stopped_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  CalmUpdates updates_;  ///< not at once, as this may come while the ROS service hands over a request
  std::unique_ptr<DdsServer> server_;
  std::unique_ptr<SomeipClient> proxy_;
};

}  // namespace

void service_to_method(RouteMaker& maker) {
  maker.each(maker.config.methods, [&](const MethodRoute& method) {
    return method.server == Server::someip
               ? std::make_shared<ServiceToMethod>(maker.context, method,
                                                   compile(method, maker.context.address, maker.types))
               : nullptr;
  });
}

}  // namespace trestle::carry
