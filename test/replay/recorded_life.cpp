#include "test/replay/recorded_life.hpp"

#include <algorithm>

namespace trestle::test {

using namespace std::chrono_literals;
using sd::EntryKind;

namespace {

/// A new process may first have sent to another receiver, with session 1: what is nearer in time to `begin`
/// than to what was sent before belongs to it.
void move_beginning(Datagrams& before, Duration begin, Datagrams& after) {
  while (before.size() > 1 && SdDatagram{before.back()->bytes}.header.session == someip::SessionId{1} &&
         begin - before.back()->time < before.back()->time - before[before.size() - 2]->time) {
    after.insert(after.begin(), before.back());
    before.pop_back();
  }
}

/// Reads off a life what its application wanted.
class Reader {
 public:
  Reader(const Recording& recording, const IpAddress& who, const Datagrams& life, const ReplayTiming& timing)
      : life_begin_{life.front()->time} {
    wishes_.to = life.back()->time + usual_wait;
    for (const RecordedBytes& datagram : recording.datagrams) {
      const bool ours = std::find(life.begin(), life.end(), &datagram) != life.end();
      const SdDatagram decoded{datagram.bytes};
      if (!decoded.good() || (datagram.from.address == who && !ours) || datagram.time > life.back()->time) {
        continue;
      }
      for (std::size_t i = 0; i < decoded.sd->entry_count(); ++i) {
        const sd::Entry entry = decoded.sd->entry(i);
        if (ours) {
          on_own(datagram, decoded, entry);
        } else {
          on_received(datagram, *decoded.sd, entry);
        }
      }
    }
    finish(*life.front(), timing);
  }

  [[nodiscard]] const Wishes& wishes() const { return wishes_; }

 private:
  void on_received(const RecordedBytes& datagram, const sd::SdMessage& message, const sd::Entry& entry) {
    if (entry.kind() == EntryKind::offer_service) {
      const auto [offer, first] = last_offer_.try_emplace(key_of(entry), datagram.time);
      offered_again_[key_of(entry)] = !first && offer->second >= life_begin_;
      offer->second = datagram.time;
    } else if (entry.kind() == EntryKind::subscribe_eventgroup) {
      asked_.try_emplace({key_of(entry), entry.eventgroup()}, endpoints_of(message, entry));
    }
  }

  void on_own(const RecordedBytes& datagram, const SdDatagram& decoded, const sd::Entry& entry) {
    const Endpoints endpoints = endpoints_of(*decoded.sd, entry);
    const ServiceKey key = key_of(entry);
    if (datagram.to.address.is_multicast()) {
      wishes_.group = datagram.to;
    }
    switch (entry.kind()) {
      case EntryKind::offer_service:
        wishes_.ttl_s = entry.ttl_s;
        on_offer(datagram, decoded.header, entry, endpoints);
        break;
      case EntryKind::stop_offer_service:
        wishes_.offers[key].periods.back().to = datagram.time;
        break;
      case EntryKind::subscribe_eventgroup_ack: {
        const Endpoints asked = asked_[{key, entry.eventgroup()}];
        wishes_.offers[key].eventgroups.try_emplace(entry.eventgroup(),
                                                    sd::Eventgroup{.id = entry.eventgroup(),
                                                                   .udp = asked.udp.has_value(),
                                                                   .tcp = asked.tcp.has_value(),
                                                                   .multicast = endpoints.multicast});
        break;
      }
      case EntryKind::find_service:
        wishes_.needs.try_emplace(key, Period{datagram.time - usual_wait, {}});
        break;
      case EntryKind::subscribe_eventgroup:
        wishes_.ttl_s = entry.ttl_s;
        on_subscribe(datagram.time, entry, endpoints);
        break;
      case EntryKind::stop_subscribe_eventgroup:
        on_stop_subscribe(datagram.time, *decoded.sd, entry);
        break;
      default:
        break;
    }
  }

  void on_offer(const RecordedBytes& datagram, const someip::Header& header, const sd::Entry& entry,
                const Endpoints& endpoints) {
    OfferWish& wish = wishes_.offers[key_of(entry)];
    wish.minor = entry.minor();
    wish.udp = endpoints.udp;
    wish.tcp = endpoints.tcp;
    if (wish.periods.empty() || wish.periods.back().to) {
      wish.periods.push_back({datagram.time - usual_wait, {}});
    }
    if (!wishes_.first_multicast_offer && datagram.to.address.is_multicast()) {
      wishes_.first_multicast_offer = datagram.time;
      wishes_.offered_before = header.session > someip::SessionId{1};
    }
  }

  void on_subscribe(Duration time, const sd::Entry& entry, const Endpoints& endpoints) {
    const ServiceKey key = key_of(entry);
    const auto offer = last_offer_.find(key);
    const bool known = offer != last_offer_.end();
    wishes_.needs.try_emplace(key, Period{(known ? offer->second : time) - 1ms, {}});
    SubscriptionWish& wish = wishes_.subscriptions[{key, entry.eventgroup()}];
    if (wish.periods.empty()) {
      wish.udp = endpoints.udp;
      wish.tcp = endpoints.tcp;
    }
    if (wish.periods.empty() || wish.periods.back().to) {
      const bool answers_offer = known && time - offer->second <= replay_tolerance && !offered_again_[key];
      wish.periods.push_back({answers_offer ? offer->second - 1ms : time, {}});
    }
  }

  // An eventgroup that is left together with its next Subscribe, or in answer to an offer, is the stack's
  // doing.
  void on_stop_subscribe(Duration time, const sd::SdMessage& message, const sd::Entry& entry) {
    const ServiceKey key = key_of(entry);
    for (std::size_t i = 0; i < message.entry_count(); ++i) {
      const sd::Entry other = message.entry(i);
      if (other.kind() == EntryKind::subscribe_eventgroup && key_of(other) == key &&
          other.eventgroup() == entry.eventgroup()) {
        return;
      }
    }
    const auto offer = last_offer_.find(key);
    if (offer != last_offer_.end() && time - offer->second < 2ms) {
      return;
    }
    const auto wish = wishes_.subscriptions.find({key, entry.eventgroup()});
    if (wish != wishes_.subscriptions.end()) {
      wish->second.periods.back().to = time;
    }
  }

  void finish(const RecordedBytes& first, const ReplayTiming& timing) {
    wishes_.from = first.time - usual_wait;
    const Duration earlier =
        wishes_.offered_before ? 7 * timing.repetitions_base_delay + timing.cyclic_offer_delay : Duration{};
    for (auto& [key, wish] : wishes_.offers) {
      if (!wish.periods.empty()) {
        wish.periods.front().from -= earlier;
        wishes_.from = std::min(wishes_.from, wish.periods.front().from);
      }
    }
    bool all_left = true;
    for (auto& [key, need] : wishes_.needs) {
      wishes_.from = std::min(wishes_.from, need.from);
      for (const auto& [group, wish] : wishes_.subscriptions) {
        all_left = all_left && wish.periods.back().to.has_value();
      }
      // Nothing is sought any more once the last eventgroup was left and nothing more was said.
      if (all_left && !wishes_.subscriptions.empty() && wishes_.to - usual_wait < 1ms + last_stop()) {
        need.to = last_stop();
      }
    }
    for (const auto& [key, wish] : wishes_.offers) {
      all_left = all_left && (wish.periods.empty() || wish.periods.back().to.has_value());
    }
    wishes_.to += all_left ? 5s : 0s;  // what has ended stays silent
    if (wishes_.group.port == 0) {
      wishes_.group = {IpAddress::v4(224, 244, 224, 245), sd_port};
    }
  }

  [[nodiscard]] Duration last_stop() const {
    Duration last{};
    for (const auto& [group, wish] : wishes_.subscriptions) {
      last = std::max(last, wish.periods.back().to.value_or(Duration{}));
    }
    return last;
  }

  Duration life_begin_;
  Wishes wishes_;
  std::map<ServiceKey, Duration> last_offer_;
  std::map<ServiceKey, bool> offered_again_;  // in this life
  std::map<GroupKey, Endpoints> asked_;
};

}  // namespace

Endpoints endpoints_of(const sd::SdMessage& message, const sd::Entry& entry) {
  Endpoints result;
  for (std::size_t i = 0; i < entry.option_count(); ++i) {
    const auto option = message.option_of(entry, i);
    const auto endpoint = option ? sd::EndpointOption::decode(*option) : tl::unexpected{sd::WireError{}};
    if (endpoint && endpoint->role == sd::EndpointRole::multicast) {
      result.multicast = endpoint->endpoint;
    } else if (endpoint) {
      (endpoint->transport == Transport::tcp ? result.tcp : result.udp) = endpoint->endpoint;
    }
  }
  return result;
}

std::vector<Datagrams> lives_of(const Recording& recording, const IpAddress& who) {
  std::vector<Datagrams> lives;
  std::map<Endpoint, someip::SessionId> last;
  for (const RecordedBytes& datagram : recording.datagrams) {
    if (datagram.from != Endpoint{who, sd_port}) {
      continue;
    }
    const SdDatagram decoded{datagram.bytes};
    if (!decoded.good()) {
      continue;
    }
    const auto before = last.find(datagram.to);
    const bool again =
        before != last.end() && decoded.header.session <= before->second && decoded.sd->reboot();
    if (lives.empty() || again) {
      lives.emplace_back();
      last.clear();
      if (lives.size() > 1) {
        move_beginning(lives[lives.size() - 2], datagram.time, lives.back());
      }
    }
    last[datagram.to] = decoded.header.session;
    lives.back().push_back(&datagram);
  }
  return lives;
}

Wishes wishes_of(const Recording& recording, const IpAddress& who, const Datagrams& life,
                 const ReplayTiming& timing) {
  return Reader{recording, who, life, timing}.wishes();
}

}  // namespace trestle::test
