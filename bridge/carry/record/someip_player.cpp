#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <tuple>

#include "bridge/carry/record/players.hpp"
#include "bridge/traffic/network_view.hpp"
#include "sd/net/node.hpp"

namespace trestle::carry {
namespace {

/// Events of a recording, their receivers, and services of its discovery, that are looked at.
constexpr std::size_t max_looked_at = 10'000;
/// Where nothing tells it.
constexpr someip::InstanceId usual_instance{1};

/// An event that somebody sent.
struct SeenEvent {
  someip::ServiceId service{};
  someip::MethodId event{};
  Endpoint from{};
  Transport transport = Transport::udp;
  std::uint8_t major = 0;
  friend bool operator<(const SeenEvent& a, const SeenEvent& b) noexcept {
    return std::tie(a.service, a.event, a.from, a.transport, a.major) <
           std::tie(b.service, b.event, b.from, b.transport, b.major);
  }
};

/// What a recording tells of services.
class Services {
 public:
  Services(ReplaySource& source, const describe::Interfaces* interfaces) : interfaces_{interfaces} {
    while (const auto one = source.next()) {
      if (one->someip) {
        look(*one->someip, TimePoint{std::chrono::nanoseconds{one->time}});
      }
    }
    source.rewind();
  }

  [[nodiscard]] const std::map<SeenEvent, std::set<Endpoint>>& events() const noexcept { return events_; }

  /// The service that an event is of, without its events.
  [[nodiscard]] sd::ServiceSpec service_of(const SeenEvent& event) const {
    sd::ServiceSpec spec{
        .service = event.service, .instance = usual_instance, .major = event.major, .udp_port = std::nullopt};
    for (const auto& [key, seen] : network_.services()) {
      if (seen.service == event.service &&
          (event.transport == Transport::udp ? seen.udp : seen.tcp) == event.from) {
        spec.instance = seen.instance;
        spec.major = seen.major;
        spec.minor = seen.minor;
        return spec;
      }
    }
    const describe::Service* const described =
        interfaces_ == nullptr ? nullptr : interfaces_->service(event.service, event.major);
    if (described != nullptr) {
      const auto index = static_cast<std::size_t>(described - interfaces_->model().services.data());
      const auto instances = interfaces_->instances_of(index);
      spec.minor = described->minor;
      spec.instance = instances.size() == 1 ? *instances.front()->id : spec.instance;
    }
    return spec;
  }

  /// Those of an event: as described, else as its receivers have subscribed.
  [[nodiscard]] std::vector<someip::EventgroupId> eventgroups_of(const SeenEvent& event,
                                                                 const std::set<Endpoint>& receivers) const {
    const auto* const element =
        interfaces_ == nullptr ? nullptr : interfaces_->element(event.service, event.major, event.event);
    if (element != nullptr && !element->eventgroups.empty()) {
      return element->eventgroups;
    }
    std::set<someip::EventgroupId> by_receiver;
    std::set<someip::EventgroupId> all;
    for (const auto& [key, seen] : network_.subscriptions()) {
      if (seen.service != event.service) {
        continue;
      }
      all.insert(seen.eventgroup);
      if (const auto& at = event.transport == Transport::tcp ? seen.tcp : seen.udp;
          (at && receivers.contains(*at)) || (seen.multicast && receivers.contains(*seen.multicast))) {
        by_receiver.insert(seen.eventgroup);
      }
    }
    const std::set<someip::EventgroupId>& found = by_receiver.size() == 1 ? by_receiver : all;
    return found.size() == 1 ? std::vector{*found.begin()} : std::vector<someip::EventgroupId>{};
  }

 private:
  void look(const RecordedMessage& one, TimePoint time) {
    const someip::Header& header = one.message.header;
    if (sd::is_sd(header)) {
      std::vector<traffic::Sighting> sightings;
      network_.on_message(one.message, one.from, one.to, time, sightings);
    } else if (header.type == someip::MessageType::notification) {
      const SeenEvent event{header.service, header.method, one.from, one.transport, header.interface_version};
      if (events_.contains(event) || events_.size() < max_looked_at) {
        std::set<Endpoint>& receivers = events_[event];
        if (receivers.size() < max_looked_at) {
          receivers.insert(one.to);
        }
      }
    }
  }

  const describe::Interfaces* interfaces_;
  traffic::NetworkView network_{max_looked_at};
  std::map<SeenEvent, std::set<Endpoint>> events_;
};

class SomeipPlayer final : public Player {
 public:
  SomeipPlayer(boost::asio::io_context& io, const sd::NodeConfig& network, ReplaySource& source,
               const describe::Interfaces* interfaces, const std::function<void(const std::string&)>& note)
      : node_{io, network, note, note} {
    const Services services{source, interfaces};
    std::map<std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t>, sd::ServiceSpec> specs;
    std::map<SeenEvent, std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t>> service_of;
    for (const auto& [event, receivers] : services.events()) {
      const std::vector<someip::EventgroupId> eventgroups = services.eventgroups_of(event, receivers);
      if (eventgroups.empty()) {
        note(fmt::format(
            "event 0x{:04x} of service 0x{:04x} is not sent: nothing says which eventgroup it is in; "
            "--interfaces does",
            value(event.event), value(event.service)));
        continue;
      }
      const sd::ServiceSpec fresh = services.service_of(event);
      const auto key = std::tuple{fresh.service, fresh.instance, fresh.major};
      sd::ServiceSpec& spec = specs.try_emplace(key, fresh).first->second;
      add(spec, event, eventgroups);
      service_of.emplace(event, key);
    }
    if (specs.empty()) {
      throw std::runtime_error{"the recording has no SOME/IP event that can be sent"};
    }
    std::map<std::tuple<someip::ServiceId, someip::InstanceId, std::uint8_t>, sd::OfferHandle> offers;
    for (const auto& [key, spec] : specs) {
      offers.emplace(key, node_.offer(spec));
      note(fmt::format("offering 0x{:04x}.0x{:04x} with {} eventgroup{}", value(spec.service),
                       value(spec.instance), spec.eventgroups.size(),
                       spec.eventgroups.size() == 1 ? "" : "s"));
    }
    for (const auto& [event, key] : service_of) {
      offers_.emplace(event, offers.at(key));
    }
  }

  bool play(const Replayed& one) override {
    if (!one.someip) {
      ++topics_;
      return false;
    }
    const someip::Header& header = one.someip->message.header;
    if (header.type != someip::MessageType::notification) {
      ++(sd::is_sd(header) ? discovery_ : calls_);
      return false;
    }
    const auto offer = offers_.find(SeenEvent{header.service, header.method, one.someip->from,
                                              one.someip->transport, header.interface_version});
    if (offer == offers_.end()) {
      ++no_eventgroup_;
      return false;
    }
    const ByteView payload = one.someip->message.payload;
    const sd::Notified notified = node_.notify(offer->second, header.method, {&payload, 1});
    dropped_ += notified.dropped;
    no_subscriber_ += notified.subscribers == 0 ? 1 : 0;
    return notified.subscribers > notified.dropped;
  }

  bool has_receivers() const override {
    return std::ranges::all_of(
        offers_, [this](const auto& one) { return node_.subscribers(one.second, one.first.event) > 0; });
  }

  std::vector<std::pair<std::string, std::uint64_t>> not_sent() const override {
    return {{"samples of topics: replay these with --to dds, beside a bridge", topics_},
            {"calls and answers, which are not replayed", calls_},
            {"messages of discovery: our own is sent", discovery_},
            {"events without a known eventgroup", no_eventgroup_},
            {"events that nobody had subscribed to", no_subscriber_},
            {"events that could not be sent", dropped_}};
  }

  void stop() override { node_.shutdown(); }

 private:
  static void add(sd::ServiceSpec& spec, const SeenEvent& event,
                  const std::vector<someip::EventgroupId>& eventgroups) {
    (event.transport == Transport::tcp ? spec.tcp_port : spec.udp_port) = std::uint16_t{0};
    if (event.transport == Transport::tcp &&
        std::ranges::find(spec.tcp_events, event.event) == spec.tcp_events.end()) {
      spec.tcp_events.push_back(event.event);
    }
    for (const someip::EventgroupId id : eventgroups) {
      auto group = std::ranges::find(spec.eventgroups, id, &sd::EventgroupSpec::id);
      if (group == spec.eventgroups.end()) {
        spec.eventgroups.push_back({.id = id});
        group = std::prev(spec.eventgroups.end());
      }
      if (std::ranges::find(group->events, event.event) == group->events.end()) {
        group->events.push_back(event.event);
      }
    }
  }

  sd::Node node_;
  std::map<SeenEvent, sd::OfferHandle> offers_;
  std::uint64_t topics_ = 0;
  std::uint64_t calls_ = 0;
  std::uint64_t discovery_ = 0;
  std::uint64_t no_eventgroup_ = 0;
  std::uint64_t no_subscriber_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace

std::unique_ptr<Player> play_to_someip(boost::asio::io_context& io, const sd::NodeConfig& network,
                                       ReplaySource& source, const describe::Interfaces* interfaces,
                                       const std::function<void(const std::string&)>& note) {
  return std::make_unique<SomeipPlayer>(io, network, source, interfaces, note);
}

}  // namespace trestle::carry
