#include "bridge/carry/runtime/make_routes.hpp"

#include <fmt/format.h>

#include <memory>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/call_shares.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/route_meter.hpp"
#include "bridge/carry/runtime/service_work.hpp"
#include "bridge/carry/runtime/suspected_loop.hpp"
#include "bridge/messages/convert/most_bytes.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

using someip::ReturnCode;

// A reply while it is sent.
struct Answer {
  dds::ServiceMessage message;
  messages::ConversionScratch scratch;
};

ReturnCode code_of(dds::CallFault fault) {
  switch (fault) {
    case dds::CallFault::unavailable:
    case dds::CallFault::too_many:
      return ReturnCode::not_ready;
    case dds::CallFault::gone:
      return ReturnCode::not_reachable;
    case dds::CallFault::timed_out:
      return ReturnCode::timeout;
    case dds::CallFault::not_written:
      break;
  }
  return ReturnCode::not_ok;
}

/// A ROS service as a method: requests of SOME/IP clients are converted, put to the ROS service, and answered
/// with what that answers. On the thread that runs the io_context. docs/services.md tells what becomes of
/// calls that go wrong.
class MethodToService final : public RunningRoute {
 public:
  /// @param context  outlives the route.
  MethodToService(const RouteContext& context, const MethodRoute& method, MethodParts parts)
      : RunningRoute{method.e2e},
        context_{context},
        method_{method},
        loop_{context.clock,
              method.ros_service,
              {dds::ros_request_topic(method.ros_service), false},
              ", which has a server of it, and the SOME/IP client at ",
              limits_of_calls},
        plans_{std::move(parts.plans)},
        ros_{loop_.suspects().watching(std::move(parts.ros))},
        log_{context.clock, method.ros_service},
        returns_{dds::ros_request_topic(method.ros_service), mark_of(context.address, method)},
        work_{std::make_shared<ServiceWork>(
            context, [this](dds::TimePoint now) { work(now); }, [this] { return client_->deadline(); })},
        shares_{method.max_calls} {}

  ~MethodToService() override { work_->stop(); }

  void describe(ServiceOffers& offers) override {
    offer_ = &offers.of(method_);
    offer_->wait_for_needs(!method_.offer_always);
    sd::ServiceSpec& service = offer_->spec();
    (method_.transport == Transport::tcp ? service.tcp_port : service.udp_port) = method_.port;
    service.methods.push_back(spec());
    if (method_.e2e) {
      service.e2e.push_back(served(method_.method, *method_.e2e, !method_.fire_and_forget));
    }
  }

  void join_dds() override {
    if (!method_.offer_always) {
      offer_->needs([this] { return was_ready_; });
    }
    client_ = context_.dds->client(ros_, work_->waker());
  }

  void stop() override { work_->stop(); }

  [[nodiscard]] CounterGroup counters() const override {
    using enum someip::CounterKind;
    CounterGroup group{"method of ROS service " + method_.ros_service,
                       {{"received", received_},
                        {"answered", answered_},
                        {"in_flight", in_flight_, now},
                        {"ready", was_ready_ ? 1U : 0U, now},
                        {"not_convertible", not_convertible_, loss},
                        {"too_large", too_large_, loss},
                        {"returned", returned_, loss},
                        {"looped", loop_.looped(), loss},
                        {"too_many", too_many_, loss},
                        {"over_share", over_share_, loss},
                        {"answers_not_convertible", answers_not_convertible_, loss},
                        {"answers_too_large", answers_too_large_, loss},
                        {"answers_not_sent", answers_not_sent_, loss}},
                       labels_of(picture_of(method_))};
    client_->counters().for_each_counter(into(group));
    append_e2e(group, e2e_);
    return group;
  }

  [[nodiscard]] RoutePicture picture(const Surroundings& /*around*/) const override {
    RoutePicture result = picture_of(method_);
    result.dds.open = was_ready_;
    result.someip.offered = offer_->handle().has_value();
    result.received = received_;
    result.carried = answered_;
    result.in_use = static_cast<std::uint32_t>(in_flight_);
    meter_.fill(result, context_.clock);
    return result;
  }

  /// Its state is OK while the ROS service is there.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool /*all*/) const override {
    const std::string at = called_id(method_.service, method_.instance, method_.method);
    diagnoses.push_back(method_state(counters(), was_ready_, "the ROS service is not there", at));
    append_checks(diagnoses, "requests to " + method_.ros_service, at);
  }

 private:
  [[nodiscard]] sd::MethodSpec spec() {
    const std::optional<std::size_t> most = plans_.request.most_bytes();
    return {.id = method_.method,
            .handler = [this](const someip::Message& request,
                              sd::Responder responder) { on_request(request, std::move(responder)); },
            .kind = method_.fire_and_forget ? someip::MethodKind::fire_and_forget
                                            : someip::MethodKind::request_response,
            .pacing = method_.tp,
            .max_request_bytes = most ? std::optional{messages::room_to_receive(*most)} : std::nullopt};
  }

  void work(dds::TimePoint now) {
    client_->work(now);
    const bool ready = client_->ready();
    if (std::exchange(was_ready_, ready) != ready) {
      offer_->update();
      tell_change();
    }
  }

  void on_request(const someip::Message& request, sd::Responder responder) {
    ++received_;
    meter_.came(context_.clock.now());
    // Its server asks us what our ROS service was asked, as long as it does not know us yet.
    returns_.update(*context_.dds);
    if (returns_.has(responder.caller().address)) {
      ++returned_;
      responder.error(ReturnCode::not_ok);
      return;
    }
    if (const auto refused = refused_by(e2e_, request)) {
      responder.error(*refused);
      return;
    }
    if (request.payload.size() > method_.tp.max_message) {
      ++too_large_;
      responder.error(ReturnCode::not_ok);
      return;
    }
    // The calls of a ring come while the one that causes them waits for its answer.
    if (loop_.refuses(request.payload, responder.caller(), *context_.dds, context_.clock.now(),
                      in_flight_ > 0 || method_.fire_and_forget)) {
      responder.error(ReturnCode::not_ok);
      return;
    }
    const auto sample = plans_.request.someip_to_cdr(request.payload, scratch_);
    if (!sample) {
      ++not_convertible_;
      log_.refused(sample.error(), request.payload, &method_.rules.payload);
      responder.error(ReturnCode::malformed_message);
      return;
    }
    const IpAddress caller = responder.caller().address;
    if (!shares_.take(caller, context_.clock.now())) {
      ++(in_flight_ < method_.max_calls ? over_share_ : too_many_);
      log_.tell(fmt::format("a call of {} was refused: it has its share of `max_calls`, {} of {} wait",
                            someip::to_string(caller), in_flight_, method_.max_calls));
      responder.error(ReturnCode::not_ready);
      return;
    }
    // A std::function is copied, which a Responder cannot be.
    const auto answer = std::make_shared<sd::Responder>(std::move(responder));
    ++in_flight_;
    client_->call(sample->slices, method_.timeout, context_.clock.now(),
                  [this, answer](tl::expected<dds::ServiceMessage, dds::CallFault> reply) {
                    on_reply(std::move(reply), *answer);
                  });
    work_->arm();
  }

  void on_reply(tl::expected<dds::ServiceMessage, dds::CallFault> reply, sd::Responder& responder) {
    --in_flight_;
    shares_.give_back(responder.caller().address);
    if (!reply) {
      log_.tell(fmt::format("a call of the ROS service failed: {}", to_string(reply.error())));
      responder.error(code_of(reply.error()));
      return;
    }
    meter_.carried(context_.clock.now(), 0);
    if (method_.fire_and_forget) {
      ++answered_;
      return;  // ROS answers every request, but nobody waits for it
    }
    const auto answer = std::make_shared<Answer>(Answer{std::move(*reply), {}});
    const auto payload = plans_.response.cdr_to_someip(answer->message.cdr(), answer->scratch);
    if (!payload) {
      ++answers_not_convertible_;
      log_.refused(payload.error(), answer->message.cdr());
      responder.error(ReturnCode::not_ok);
      return;
    }
    if (payload->bytes > method_.tp.max_message) {
      ++answers_too_large_;
      responder.error(ReturnCode::not_ok);
      return;
    }
    ++(responder.respond(payload->slices, answer) ? answered_ : answers_not_sent_);
  }

  const RouteContext& context_;
  const MethodRoute method_;
  SuspectedLoop loop_;  ///< closed by a ROS server at the caller's host
  messages::ServicePlans plans_;
  const dds::ServiceConfig ros_;
  messages::ConversionScratch scratch_;
  ConversionLog log_;
  ServiceOffer* offer_ = nullptr;
  Returns returns_;
  std::shared_ptr<ServiceWork> work_;
  bool was_ready_ = false;
  RouteMeter meter_;
  std::uint64_t returned_ = 0;
  std::uint64_t received_ = 0;
  std::uint64_t answered_ = 0;
  std::uint64_t in_flight_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
  std::uint64_t answers_not_convertible_ = 0;
  std::uint64_t answers_too_large_ = 0;
  std::uint64_t answers_not_sent_ = 0;
  std::uint64_t over_share_ = 0;
  std::uint64_t too_many_ = 0;
  CallShares shares_;
  std::unique_ptr<DdsClient> client_;  // last: it has the calls, which use the above
};

}  // namespace

void method_to_service(RouteMaker& maker) {
  maker.each(maker.config.methods, [&](const MethodRoute& method) {
    return method.server == Server::ros
               ? std::make_shared<MethodToService>(maker.context, method,
                                                   compile(method, maker.context.address, maker.types))
               : nullptr;
  });
}

}  // namespace trestle::carry
