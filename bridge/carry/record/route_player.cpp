#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "bridge/carry/record/players.hpp"
#include "bridge/carry/runtime/make_routes.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "sd/net/e2e_channel.hpp"
#include "sd/wire/message.hpp"

namespace trestle::carry {
namespace {

/// SOME/IP as routes see it, when all that comes is from a recording: each service is there, and nothing is
/// sent. Only what takes events is used.
class ReplayedSomeip final : public SomeipSide {
 public:
  /// Hands an event to the subscriptions that want it.
  /// @return whether there was one.
  bool deliver(const RecordedMessage& recorded) {
    bool taken = false;
    for (auto& [id, one] : subscriptions_) {
      const someip::Header& header = recorded.message.header;
      if (one.spec.service != header.service ||
          std::ranges::find(one.spec.events, header.method) == one.spec.events.end()) {
        continue;
      }
      if (one.spec.major != header.interface_version) {
        ++other_version_;
        continue;
      }
      taken = true;
      hand_over(one, recorded);
    }
    return taken;
  }
  [[nodiscard]] std::uint64_t other_version() const noexcept { return other_version_; }

  sd::OfferHandle offer(const sd::ServiceSpec& /*spec*/) override { return {}; }
  void withdraw(sd::OfferHandle /*offer*/) override {}
  std::shared_ptr<const void> hold_port(std::uint16_t /*number*/, Transport /*transport*/) override {
    return nullptr;
  }
  std::size_t subscribers(sd::OfferHandle /*offer*/, someip::MethodId /*event*/) const override { return 0; }
  sd::Notified notify(sd::OfferHandle /*offer*/, someip::MethodId /*event*/,
                      std::span<const ByteView> /*payload*/,
                      const std::shared_ptr<const void>& /*keep_alive*/,
                      const someip::TpPacing& /*pacing*/) override {
    return {};
  }
  void when_room(sd::OfferHandle /*offer*/, someip::MethodId /*event*/, std::size_t /*bytes*/,
                 std::function<void()> /*told*/) override {}
  sd::Notified set_field(sd::OfferHandle /*offer*/, someip::MethodId /*field*/,
                         std::shared_ptr<const std::vector<std::byte>> /*value*/) override {
    return {};
  }
  std::shared_ptr<const std::vector<std::byte>> field(sd::OfferHandle /*offer*/,
                                                      someip::MethodId /*field*/) const override {
    return nullptr;
  }
  void forget_field(sd::OfferHandle /*offer*/, someip::MethodId /*field*/) override {}
  std::unique_ptr<SomeipClient> client(const sd::RequireSpec& /*spec*/,
                                       sd::AvailabilityHandler /*handler*/) override {
    return nullptr;
  }

  sd::RequirementId require(const sd::RequireSpec& spec, sd::AvailabilityHandler /*handler*/) override {
    sd::RemoteService service;
    service.service = spec.service;
    service.instance = spec.instance;
    service.major = spec.major;
    required_.push_back(service);
    return static_cast<sd::RequirementId>(required_.size() - 1);
  }
  std::vector<sd::RemoteService> available(sd::RequirementId requirement) const override {
    return {required_[static_cast<std::size_t>(requirement)]};
  }
  bool is_offered_by_others(someip::ServiceId /*service*/) const override { return true; }
  sd::SubscriptionId subscribe(const sd::SubscribeSpec& spec, sd::EventHandler handler) override {
    const auto id = static_cast<sd::SubscriptionId>(next_++);
    Subscription& one = subscriptions_[id];
    one.spec = spec;
    one.handler = std::move(handler);
    for (const sd::E2eSpec& e2e : spec.e2e) {
      one.e2e.add(std::make_shared<sd::E2eChannel>(e2e));
    }
    return id;
  }
  void unsubscribe(sd::SubscriptionId subscription) override { subscriptions_.erase(subscription); }
  bool subscribed(sd::SubscriptionId /*subscription*/) const override { return true; }
  sd::SubscriptionFaults subscription_faults(sd::SubscriptionId /*subscription*/) const override {
    return {};
  }
  sd::OtherEvents other_events(sd::SubscriptionId /*subscription*/) const override { return {}; }

 private:
  struct Subscription {
    sd::SubscribeSpec spec{};
    sd::EventHandler handler{};
    sd::E2eChannels e2e{};
  };

  /// As a node does. Who reads the topic at the sender's host is of no interest now, so no sender is told.
  void hand_over(Subscription& to, const RecordedMessage& recorded) {
    someip::Message message = recorded.message;
    sd::E2eChannel* const channel = to.e2e.find(message.header.method);
    if (channel == nullptr) {
      to.handler(message, Endpoint{});
      return;
    }
    const someip::e2e::CheckResult result =
        channel->check({recorded.from, recorded.transport}, message, {}, true, room_);
    message.check = &result;
    to.handler(message, Endpoint{});
  }

  std::vector<sd::RemoteService> required_;
  std::map<sd::SubscriptionId, Subscription> subscriptions_;
  std::uint32_t next_ = 0;
  std::vector<std::byte> room_;
  std::uint64_t other_version_ = 0;
};

/// Only what takes events is left.
BridgeConfig& only_events(BridgeConfig& config, const Remaps& remaps) {
  std::erase_if(config.routes,
                [](const Route& route) { return route.direction != Direction::someip_to_dds; });
  if (config.routes.empty()) {
    throw std::runtime_error{fmt::format("{} has no route with direction: someip_to_dds", config.file)};
  }
  config.methods.clear();
  config.patterns.clear();
  for (Route& route : config.routes) {
    // What is offered and who reads does not matter to a recording.
    route.presence = {};
    const auto mapped = std::ranges::find(remaps, route.topic, &Remaps::value_type::first);
    route.topic = mapped == remaps.end() ? route.topic : mapped->second;
  }
  return config;
}

class RoutePlayer final : public Player {
 public:
  RoutePlayer(boost::asio::io_context& io, const dds::ParticipantConfig& participant, BridgeConfig& config,
              const Remaps& remaps)
      : clock_{clock_of(io)},
        context_{.io = io, .clock = *clock_, .report = report_, .address = config.someip.address},
        types_{messages::TypeLibrary::in(config.types)},
        participant_{participant},
        dds_{dds_side_of(participant_)},
        routes_{make_routes(context_, only_events(config, remaps), types_), config} {
    context_.someip = &someip_;
    context_.dds = dds_.get();
    routes_.join_someip(someip_);
    routes_.join_dds();
  }

  bool play(const Replayed& one) override {
    if (!one.someip) {
      ++topics_;
      return false;
    }
    if (const someip::Header& header = one.someip->message.header;
        header.type != someip::MessageType::notification || sd::is_sd(header)) {
      ++other_messages_;
      return false;
    }
    const bool taken = someip_.deliver(*one.someip);
    no_route_ += taken ? 0 : 1;
    return taken;
  }

  bool has_receivers() const override {
    return std::ranges::all_of(routes_,
                               [](const auto& one) { return one.route->picture({}).dds.matched > 0; });
  }

  std::vector<std::pair<std::string, std::uint64_t>> not_sent() const override {
    std::vector<std::pair<std::string, std::uint64_t>> all{
        {"messages of topics, which are replayed without --config", topics_},
        {"calls, answers and messages of discovery", other_messages_},
        {"events that no route takes", no_route_ - std::min(no_route_, someip_.other_version())},
        {"events of another major version", someip_.other_version()}};
    for (const auto& [mark, route] : routes_) {
      const CounterGroup counters = route->counters();
      for (const auto& counter : counters.counters) {
        if (counter.kind == someip::CounterKind::loss && counter.count > 0) {
          all.emplace_back(fmt::format("{}: {}", counters.name, counter.name), counter.count);
        }
      }
    }
    return all;
  }

  void stop() override { routes_.stop(); }

 private:
  std::unique_ptr<RouteClock> clock_;
  Report report_;
  RouteContext context_;
  messages::TypeLibrary types_;
  ReplayedSomeip someip_;
  dds::Participant participant_;
  std::unique_ptr<DdsSide> dds_;
  Routes routes_;
  std::uint64_t topics_ = 0;
  std::uint64_t other_messages_ = 0;
  std::uint64_t no_route_ = 0;
};

}  // namespace

std::unique_ptr<Player> play_to_routes(boost::asio::io_context& io, const dds::ParticipantConfig& participant,
                                       BridgeConfig& config, const Remaps& remaps) {
  return std::make_unique<RoutePlayer>(io, participant, config, remaps);
}

}  // namespace trestle::carry
