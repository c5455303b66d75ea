#include "test/replay/sd_replay.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <set>
#include <utility>

#include "test/replay/recorded_life.hpp"
#include "test/sd/describe.hpp"

namespace trestle::test {

using namespace std::chrono_literals;
using sd::EntryKind;

namespace {

/// An entry in words. The TTL of a Find has no meaning and is left out, the options' order neither.
std::string in_words(const sd::SdMessage& message, const sd::Entry& entry) {
  sd::Entry bare = entry;
  bare.first_run.count = bare.second_run.count = 0;
  if (bare.kind() == EntryKind::find_service) {
    bare.ttl_s = 3;
  }
  std::multiset<std::string> options;
  const std::size_t bare_size = describe(message, bare).size();
  for (std::size_t i = 0; i < entry.option_count(); ++i) {
    sd::Entry one = bare;
    const bool first = i < entry.first_run.count;
    const std::size_t index =
        first ? entry.first_run.index + i : entry.second_run.index + i - entry.first_run.count;
    one.first_run = {static_cast<std::uint8_t>(index), 1};
    options.insert(describe(message, one).substr(bare_size));
  }
  std::string text = describe(message, bare);
  for (const std::string& option : options) {
    text += option;
  }
  return text;
}

void add_words(std::vector<Said>& said, const sd::SdMessage& message, Duration time, const Endpoint& to) {
  for (std::size_t i = 0; i < message.entry_count(); ++i) {
    const sd::Entry entry = message.entry(i);
    said.push_back({time, to, entry.kind(), in_words(message, entry)});
  }
}

/// Our machine living one life.
class Life {
 public:
  Life(const Recording& recording, const IpAddress& who, const ReplayTiming& timing, const Wishes& wishes,
       ReplayResult& result)
      : recording_{recording},
        who_{who},
        wishes_{wishes},
        result_{result},
        discovery_{settings(timing), storage_->view()} {
    plan_inputs();
    plan_offers();
    plan_needs();
    for (const auto& [time, step] : steps_) {
      if (time > wishes_.to) {
        break;
      }
      advance(time);
      step();
      drain();
    }
    advance(wishes_.to);
  }

  std::vector<Said> said;

 private:
  [[nodiscard]] sd::Settings settings(const ReplayTiming& timing) const {
    sd::Settings settings;
    settings.unicast = {who_, sd_port};
    settings.multicast = wishes_.group;
    settings.explicit_initial_data = false;  // which vsomeip does not know
    settings.own_endpoints_only = false;     // nor does it look at that
    settings.timing.initial_delay_min = settings.timing.initial_delay_max = first_delay();
    settings.timing.repetitions_base_delay = timing.repetitions_base_delay;
    settings.timing.cyclic_offer_delay = timing.cyclic_offer_delay;
    settings.timing.request_response_delay_min = settings.timing.request_response_delay_max = 0ms;
    settings.timing.ttl_s = wishes_.ttl_s;
    return settings;
  }
  // Offers that were answered to a Find before the first one to all began their initial wait before that.
  [[nodiscard]] Duration first_delay() const {
    if (wishes_.offered_before || !wishes_.first_multicast_offer) {
      return usual_wait;
    }
    Duration begin = *wishes_.first_multicast_offer - usual_wait;
    for (const auto& [key, wish] : wishes_.offers) {
      begin = wish.periods.empty() ? begin : std::min(begin, wish.periods.front().from);
    }
    return *wishes_.first_multicast_offer - begin;
  }
  [[nodiscard]] TimePoint now() const { return TimePoint{1000s} + now_; }

  void plan_inputs() {
    for (const RecordedBytes& datagram : recording_.datagrams) {
      const bool to_us = datagram.to.port == sd_port &&
                         (datagram.to.address == who_ || datagram.to.address == wishes_.group.address);
      if (to_us && datagram.from.address != who_ && datagram.time >= wishes_.from) {
        steps_.emplace(datagram.time, [this, &datagram] { receive(datagram); });
      }
    }
    for (const RecordedConnection& connection : recording_.connections) {
      if (connection.server.address == who_ && connection.time >= wishes_.from) {
        steps_.emplace(connection.time, [this, &connection] {
          if (connection.opened) {
            discovery_.tcp_connected(connection.server, connection.client);
          } else {
            discovery_.tcp_closed(connection.server, connection.client);
          }
        });
      }
    }
  }

  void receive(const RecordedBytes& datagram) {
    const SdDatagram decoded{datagram.bytes};
    for (std::size_t i = 0; decoded.good() && i < decoded.sd->entry_count(); ++i) {
      const EntryKind kind = decoded.sd->entry(i).kind();
      if (kind == EntryKind::find_service) {
        result_.context.finds_received.push_back(datagram.time);
      } else if (kind == EntryKind::offer_service) {
        result_.context.offers_received.push_back(datagram.time);
      }
    }
    discovery_.on_datagram(datagram.bytes, datagram.from, datagram.to.address.is_multicast(), now());
  }

  void plan_offers() {
    for (const auto& [key, wish] : wishes_.offers) {
      for (const Period& period : wish.periods) {
        const auto handle = std::make_shared<sd::OfferHandle>();
        steps_.emplace(period.from, [this, handle, &key = key, &wish = wish] { offer(*handle, key, wish); });
        if (period.to) {
          steps_.emplace(*period.to, [this, handle] { discovery_.stop_offer(*handle, now()); });
        }
      }
    }
  }

  void offer(sd::OfferHandle& handle, const ServiceKey& key, const OfferWish& wish) {
    std::vector<sd::Eventgroup> eventgroups;
    for (const auto& [id, eventgroup] : wish.eventgroups) {
      eventgroups.push_back(eventgroup);
    }
    const auto offered = discovery_.offer({.service = std::get<0>(key),
                                           .instance = std::get<1>(key),
                                           .major = std::get<2>(key),
                                           .minor = wish.minor,
                                           .udp = wish.udp,
                                           .tcp = wish.tcp,
                                           .eventgroups = eventgroups},
                                          now());
    if (!offered) {
      result_.broken.push_back(std::string{"offer refused: "} + to_string(offered.error()));
      return;
    }
    handle = *offered;
    result_.context.offered.push_back(now_ + first_delay());
  }

  void plan_needs() {
    for (const auto& [key, need] : wishes_.needs) {
      const auto requirement = std::make_shared<sd::RequirementHandle>();
      steps_.emplace(need.from, [this, requirement, &key = key] {
        const auto made = discovery_.require(
            {.service = std::get<0>(key), .instance = std::get<1>(key), .major = std::get<2>(key)}, now());
        *requirement = made.value_or(sd::RequirementHandle{});
      });
      for (const auto& [group, wish] : wishes_.subscriptions) {
        if (group.first == key) {
          plan_subscription(group.second, wish, requirement, need.from);
        }
      }
      if (need.to) {
        steps_.emplace(*need.to, [this, requirement] { discovery_.release(*requirement, now()); });
      }
    }
  }

  void plan_subscription(sd::EventgroupId id, const SubscriptionWish& wish,
                         const std::shared_ptr<sd::RequirementHandle>& requirement, Duration earliest) {
    for (const Period& period : wish.periods) {
      const auto handle = std::make_shared<sd::SubscriptionHandle>();
      steps_.emplace(std::max(period.from, earliest), [this, handle, requirement, id, &wish] {
        const auto made =
            discovery_.subscribe(*requirement, {.eventgroup = id, .udp = wish.udp, .tcp = wish.tcp}, now());
        if (!made) {
          result_.broken.push_back(std::string{"subscription refused: "} + to_string(made.error()));
        }
        *handle = made.value_or(sd::SubscriptionHandle{});
      });
      if (period.to) {
        steps_.emplace(*period.to, [this, handle] { discovery_.unsubscribe(*handle, now()); });
      }
    }
  }

  void advance(Duration time) {
    while (const auto deadline = discovery_.deadline()) {
      if (*deadline - TimePoint{1000s} > time) {
        break;
      }
      now_ = std::max(now_, *deadline - TimePoint{1000s});
      drain();
    }
    now_ = time;
  }

  void drain() {
    discovery_.on_time(now());
    std::array<std::byte, 1400> room{};
    while (const auto sent = discovery_.poll_transmit(room, now())) {
      const SdDatagram decoded{sent->bytes};
      if (!decoded.good() || find_fault(*decoded.sd)) {
        result_.broken.push_back("malformed: " + describe_datagram(sent->bytes));
        continue;
      }
      // One counter for all that goes to the group, one for each peer.
      const auto expected = static_cast<someip::SessionId>(++sessions_[sent->destination]);
      if (decoded.header.session != expected || decoded.sd->flags() != (sd::reboot_flag | sd::unicast_flag)) {
        result_.broken.push_back("session or flags: " + describe_datagram(sent->bytes));
      }
      add_words(said, *decoded.sd, now_, sent->destination);
    }
    while (discovery_.poll_event()) {
    }
  }

  const Recording& recording_;
  IpAddress who_;
  const Wishes& wishes_;
  ReplayResult& result_;
  Duration now_ = Duration::min() / 2;
  std::unique_ptr<sd::Storage<>> storage_ = std::make_unique<sd::Storage<>>();
  sd::ServiceDiscovery discovery_;
  std::multimap<Duration, std::function<void()>> steps_;
  std::map<Endpoint, std::uint16_t> sessions_;
};

/// Leaves the entries that only one of the two sent, each compared with the first like it.
void compare(const std::vector<Said>& theirs, std::vector<Said> ours, ReplayResult& result) {
  for (const Said& said : theirs) {
    const auto same = std::find_if(ours.begin(), ours.end(), [&](const Said& other) {
      return other.to == said.to && other.text == said.text && other.time - said.time <= replay_tolerance &&
             said.time - other.time <= replay_tolerance;
    });
    if (same == ours.end()) {
      result.only_theirs.push_back(said);
    } else {
      ++result.same;
      ours.erase(same);
    }
  }
  result.only_ours.insert(result.only_ours.end(), ours.begin(), ours.end());
}

/// What a recorded life said, with the first port that it subscribed with instead of later ones.
std::vector<Said> recorded_words(const Datagrams& life, const Wishes& wishes, std::size_t& new_ports) {
  std::vector<Said> said;
  for (const RecordedBytes* datagram : life) {
    const SdDatagram decoded{datagram->bytes};
    for (std::size_t i = 0; i < decoded.sd->entry_count(); ++i) {
      const sd::Entry entry = decoded.sd->entry(i);
      Said one{datagram->time, datagram->to, entry.kind(), in_words(*decoded.sd, entry)};
      const auto wish = wishes.subscriptions.find({key_of(entry), entry.eventgroup()});
      const bool of_client = entry.kind() == EntryKind::subscribe_eventgroup ||
                             entry.kind() == EntryKind::stop_subscribe_eventgroup;
      if (of_client && wish != wishes.subscriptions.end()) {
        const Endpoints endpoints = endpoints_of(*decoded.sd, entry);
        for (const auto& [now, first] :
             {std::pair{endpoints.udp, wish->second.udp}, std::pair{endpoints.tcp, wish->second.tcp}}) {
          if (now && first && *now != *first) {
            const std::string port = describe(*now);
            one.text.replace(one.text.find(port), port.size(), describe(*first));
            ++new_ports;
          }
        }
      }
      said.push_back(std::move(one));
    }
  }
  return said;
}

}  // namespace

ReplayResult replay(const Recording& recording, const IpAddress& who, const ReplayTiming& timing) {
  ReplayResult result;
  for (const Datagrams& datagrams : lives_of(recording, who)) {
    const Wishes wishes = wishes_of(recording, who, datagrams, timing);
    Life life{recording, who, timing, wishes, result};
    std::erase_if(life.said, [&](const Said& said) {  // before the recording began
      return said.time < datagrams.front()->time - replay_tolerance;
    });
    compare(recorded_words(datagrams, wishes, result.new_ports), std::move(life.said), result);
  }
  return result;
}

}  // namespace trestle::test
