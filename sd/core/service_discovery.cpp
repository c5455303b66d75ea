#include "sd/core/service_discovery.hpp"

#include "sd/core/receive_buffer.hpp"
#include "sd/wire/writer.hpp"
#include "someip/wire/enumerator_name.hpp"

namespace trestle::sd {

const char* to_string(LossReason reason) noexcept {
  static constexpr std::array names{"stopped",   "expired",     "rebooted", "replaced",
                                    "link down", "unreachable", "displaced"};
  return someip::enumerator_name<LossReason::displaced>(names, reason);
}

const char* to_string(SdError error) noexcept {
  static constexpr std::array names{"table full", "duplicate", "bad argument", "unknown handle"};
  return someip::enumerator_name<SdError::unknown_handle>(names, error);
}

const char* to_string(NackReason reason) noexcept {
  constexpr std::array all{"unknown service",    "unknown instance", "unknown major version",
                           "unknown eventgroup", "bad options",      "missing endpoint",
                           "no TCP connection",  "no room",          "not allowed"};
  static constexpr auto names = [&all] {  // the last one takes no room where it cannot be
    std::array<const char*, nack_reasons> used{};
    std::copy_n(all.begin(), used.size(), used.begin());
    return used;
  }();
  return someip::enumerator_name<static_cast<NackReason>(nack_reasons - 1)>(names, reason);
}

const char* to_string(Limit limit) noexcept {
  static constexpr std::array names{"max_peers",
                                    "max_subscribers",
                                    "max_subscribers_per_eventgroup",
                                    "max_subscribers_per_eventgroup_and_address",
                                    "max_remote_services",
                                    "max_tcp_connections",
                                    "max_configurations",
                                    "max_configuration_bytes",
                                    "max_pending_entries",
                                    "max_pending_events",
                                    "max_entries_per_second",
                                    "max_reboots_at_once"};
  return someip::enumerator_name<Limit::reboots>(names, limit);
}

ServiceDiscovery::ServiceDiscovery(const Settings& settings, const StorageView& storage) noexcept
    : pending_{storage.pending_entries},
      events_{storage.pending_events},
      silences_{storage.silences},
      peers_{storage.peers},
      remotes_{storage.remotes},
      ids_{storage.ids},
      requirements_{storage.requirements},
      subscriptions_{storage.subscriptions},
      offers_{storage.offers},
      subscribers_{storage.subscribers},
      eventgroups_{storage.eventgroups},
      tcp_connections_{storage.tcp_connections},
      configurations_{storage.configuration_bytes, storage.configurations},
      settings_{settings},
      rules_{settings_},
      random_{settings.seed},
      rivals_{storage.rivals} {
  assert(settings.timing.ttl_s >= 1 && settings.timing.ttl_s <= infinite_ttl_s);
  assert(settings.timing.initial_delay_min <= settings.timing.initial_delay_max);
  assert(settings.max_entries_per_second >= 1 && settings.max_entries_at_once >= 1);
  assert(settings.timing.request_response_delay_min <= settings.timing.request_response_delay_max);
  assert(!settings.sd_endpoint || settings.sd_endpoint->address.v6 == settings.unicast.address.v6);
}

// Offers and Finds that start about the same time share the delay, and so a message.  [feat_req_someipsd_65]
TimePoint ServiceDiscovery::first_due(TimePoint now) noexcept {
  const Duration min = settings_.timing.initial_delay_min;
  const Duration max = settings_.timing.initial_delay_max;
  const auto joinable = [earliest = now + min, latest = now + max](const OfferSchedule& schedule) {
    return schedule.phase() == Phase::initial_wait && is_due(earliest, schedule.deadline()) &&
           is_due(schedule.deadline(), latest);
  };
  for (const slots::Offer& offer : offers_) {
    if (joinable(offer.schedule)) {
      return offer.schedule.deadline();
    }
  }
  for (const slots::Requirement& requirement : requirements_) {
    if (joinable(requirement.schedule)) {
      return requirement.schedule.deadline();
    }
  }
  return now + random_.between(min, max);
}

slots::PendingEntry* ServiceDiscovery::send(std::uint16_t to, TimePoint due) noexcept {
  slots::PendingEntry* const pending = pending_.append();
  if (pending == nullptr) {
    refuse(Limit::pending_entries);
    return nullptr;
  }
  *pending = {};
  pending->peer = to;
  pending->due = due;
  note_due(due);
  return pending;
}

Happening* ServiceDiscovery::next_event() noexcept {
  Happening* const event = events_.append();
  if (event == nullptr) {
    count(counters_.lost_events);
    note(Limit::pending_events);
  }
  return event;
}

void ServiceDiscovery::link_down() noexcept {
  link_up_ = false;
  pending_.clear();
  for (slots::Subscriber& subscription : subscribers_) {
    if (subscription.peer != slots::Subscriber::nobody) {
      lose(subscription, LossReason::link_down);
    }
  }
  for (slots::Remote& remote : remotes_) {
    lose(remote, LossReason::link_down, {});
  }
  for (slots::Offer& offer : offers_) {
    offer.schedule = {};
  }
  for (slots::Requirement& requirement : requirements_) {
    requirement.schedule = {};
  }
}

void ServiceDiscovery::link_up(TimePoint now) noexcept {
  if (link_up_) {
    return;
  }
  link_up_ = true;
  for (slots::Offer& offer : offers_) {
    start(offer.schedule, now);
  }
  for (slots::Requirement& requirement : requirements_) {
    start(requirement.schedule, now);
  }
}

void ServiceDiscovery::shutdown(TimePoint now) noexcept {
  pending_.clear();
  for (slots::Requirement& requirement : requirements_) {
    release(requirements_.handle_of<RequirementHandle>(requirement), now);
  }
  for (slots::Offer& offer : offers_) {
    stop_offer(offers_.handle_of<OfferHandle>(offer), now);
  }
  for (slots::Remote& remote : remotes_) {
    remove(remote);
  }
  link_up_ = false;
}

void ServiceDiscovery::on_datagram(ByteView datagram, const Endpoint& from, bool via_multicast,
                                   TimePoint now) noexcept {
  count(counters_.datagrams_received);
  if (!link_up_) {
    count(counters_.dropped_down);
    return;
  }
  if (from == settings_.unicast) {
    count(counters_.dropped_own);
    return;
  }
  const bool port_fits = settings_.only_from_sd_port ? from.port == settings_.unicast.port : from.port != 0;
  if (!port_fits || !rules_.allow(from.address)) {
    count(counters_.dropped_source);
    return;
  }
  someip::MessageCursor cursor{datagram};
  while (const auto message = cursor.next()) {
    on_message(*message, from, via_multicast, now);
  }
  if (cursor.error()) {
    count(counters_.dropped_malformed);
  }
}

void ServiceDiscovery::on_message(const someip::Message& bytes, const Endpoint& from, bool via_multicast,
                                  TimePoint now) noexcept {
  const auto message = decode(bytes);
  if (!message) {
    count(message.error().error == WireError::not_sd ? counters_.dropped_not_sd
                                                     : counters_.dropped_malformed);
    return;
  }
  std::optional<Endpoint> named = sd_endpoint(*message, rules_);
  if (named && !rules_.may_name(from.address, named->address)) {
    count(counters_.ignored_foreign_endpoints);
    named.reset();
  }
  slots::Peer* const place = peer_at(named ? *named : from, now);
  if (!guards && place == nullptr) {
    refuse(Limit::peers);
    return;
  }
  slots::Peer& peer = *place;
  const std::uint16_t peer_index = peer.index;
  // Session 0 says that the sender does not count its messages.
  if (const SessionId session = bytes.header.session; session != someip::no_session) {
    const auto channel =
        via_multicast ? RebootDetector::Channel::multicast : RebootDetector::Channel::unicast;
    std::uint32_t content = 0;
    if constexpr (guards) {
      if (is_due(peer.last_seen + settings_.duplicate_window, now)) {
        peer.recent = {};
      }
      content = RecentMessages::hash(channel, session, bytes.payload);
      if (peer.recent.has(content) && peer.reboots.is_repeated(channel, session)) {
        count(counters_.dropped_duplicates);
        return;
      }
    }
    if (peer.reboots.shows_reboot(channel, session, message->reboot())) {
      if (!guards && !events_.empty()) {  // the next message shows it as well
        refuse(Limit::pending_events);
        return;
      }
      if (!peer.real_reboots.take(now, settings_.reboot_pause, settings_.max_reboots_at_once)) {
        count(counters_.dropped_reboots);
        note(Limit::reboots);
        return;
      }
      on_reboot(peer_index, now);
      peer.recent = {};
    }
    peer.reboots.observe(channel, session, message->reboot());
    peer.recent.add(content);
  }
  for (slots::TcpConnection& connection : tcp_connections_) {
    connection.peer_spoke = connection.peer_spoke || connection.remote.address == peer.endpoint.address;
  }
  note_heard(peer, now);
  peer.explicit_initial_data = message->explicit_initial_data();  // [feat_req_someipsd_1188]
  count(counters_.messages_received);
  // One delay for the whole message, so that the answers share a message too. Only multicast messages need
  // one.  [feat_req_someipsd_83] [feat_req_someipsd_766] [feat_req_someipsd_624]
  const Timing& timing = settings_.timing;
  const Duration delay =
      via_multicast ? random_.between(timing.request_response_delay_min, timing.request_response_delay_max)
                    : Duration{};
  const Arrival arrival{*message, from.address, peer_index, via_multicast, now + delay, now};
  for (std::size_t i = 0; i < message->entry_count(); ++i) {  // in their order  [feat_req_someipsd_862]
    on_entry(message->entry(i), arrival);
  }
}

// A peer that may use a foreign address for its SD endpoint may use it for other endpoints, too.
bool ServiceDiscovery::is_foreign(const EntryOptions& options, const Arrival& arrival) const noexcept {
  for (const std::optional<Endpoint>* const one : {&options.udp, &options.tcp}) {
    if (*one && (*one)->address != peers_[arrival.peer].endpoint.address &&
        !rules_.may_name(arrival.source, (*one)->address)) {
      return true;
    }
  }
  return false;
}

bool ServiceDiscovery::has_name(ServiceId service, std::uint16_t configuration,
                                std::string_view name) const noexcept {
  return service != other_protocols || otherserv_of(configurations_[configuration]) == name;
}

std::string_view ServiceDiscovery::name_in(const Entry& entry, const Arrival& arrival) noexcept {
  if (entry.service != other_protocols) {
    return {};
  }
  const MergedConfiguration merged = merge_configurations(arrival.message, entry, configurations_.room());
  return otherserv_of(configurations_[configurations_.take(merged.body)]);
}

// Keeps the configuration that was read last. An important one displaces services that nobody requires.
std::optional<std::uint16_t> ServiceDiscovery::keep_configuration(bool important) noexcept {
  const auto mark = [this](auto in_use) {
    const auto mark_all = [&](const auto& table) {
      for (const auto& slot : table) {
        in_use(slot.configuration);
      }
    };
    mark_all(offers_);
    mark_all(requirements_);
    mark_all(remotes_.all());
    for (std::size_t i = 0; i < pending_.size(); ++i) {
      in_use(pending_[i].configuration);
    }
  };
  auto kept = configurations_.keep(mark);
  for (slots::Remote& remote : remotes_) {
    if (kept || !important) {
      break;
    }
    if (remote.configuration != ConfigurationPool::none && !remote.is_wanted) {
      remove(remote);
      kept = configurations_.keep(mark);
    }
  }
  return kept;
}

void ServiceDiscovery::on_entry(const Entry& entry, const Arrival& arrival) noexcept {
  switch (entry.kind()) {
    case EntryKind::find_service:
      return on_find(entry, arrival);
    case EntryKind::offer_service:
      return on_offer(entry, arrival);
    case EntryKind::stop_offer_service:
      return on_stop_offer(entry, arrival);
    case EntryKind::subscribe_eventgroup:
    case EntryKind::stop_subscribe_eventgroup:
      return on_subscribe(entry, arrival);
    case EntryKind::subscribe_eventgroup_ack:
    case EntryKind::subscribe_eventgroup_nack:
      return on_ack(entry, arrival);
    case EntryKind::unknown:
      break;
  }
  count(counters_.ignored_unknown_type);
}

void ServiceDiscovery::on_time(TimePoint now) noexcept {
  if (link_up_) {
    serve(now);
    seek(now);
    watch(now);
  }
}

namespace {

// The options of a pending entry, in the form that the writer takes.
struct OptionList {
  OptionList(const slots::PendingEntry& pending, ByteView configuration) noexcept
      : receive_buffer{pending.receive_buffer_bytes} {
    for (std::size_t i = 0; i < pending.option_count; ++i) {
      add(pending.options[i].view());
    }
    if (!configuration.empty()) {
      add({OptionType::configuration, configuration});
    } else if (pending.receive_buffer_bytes != 0) {
      add(receive_buffer.view());
    }
  }
  OptionList(const OptionList&) = delete;
  OptionList& operator=(const OptionList&) = delete;
  void add(const Option& option) noexcept {
    options[count++] = option;
    bytes += option.size();
  }
  [[nodiscard]] std::span<const Option> view() const noexcept { return std::span{options}.first(count); }

  ReceiveBufferOption receive_buffer;
  std::array<Option, std::tuple_size_v<decltype(slots::PendingEntry::options)> + 1> options;
  std::size_t count = 0;
  std::size_t bytes = 0;
};

}  // namespace

// Behind all others: there are clients that take the first option for that of their service.
inline void ServiceDiscovery::tell_network(SdWriter& writer) const noexcept {
  for (const std::optional<Endpoint>& network : gateway_to_) {
    if (network) {  // has no room beside a single huge entry
      static_cast<void>(
          writer.add_unreferenced(EndpointOption{EndpointRole::multicast, *network}.encode().view()));
    }
  }
}

// Whether that has room behind an entry with so many bytes of options.
inline bool ServiceDiscovery::leaves_room(const SdWriter& writer, std::size_t option_bytes) const noexcept {
  constexpr std::size_t most = 24;  // of an IPv6 endpoint
  return std::ranges::none_of(gateway_to_, [&](const std::optional<Endpoint>& network) {
    return network && !writer.fits(1, option_bytes + most);
  });
}

std::optional<Transmit> ServiceDiscovery::poll_transmit(ByteSpan room, TimePoint now) noexcept {
  constexpr std::uint16_t nobody = 0xfffe;
  if (room.size() < SdWriter::min_room_bytes || (optimised_for_many && !is_due(transmit_due_, now))) {
    return std::nullopt;
  }
  SdWriter writer{room};
  if (settings_.sd_endpoint) {  // in front of all others  [feat_req_someipsd_1151] [feat_req_someipsd_1153]
    const OwnedOption option = EndpointOption{EndpointRole::sd, *settings_.sd_endpoint}.encode();
    if (!writer.add_unreferenced(option.view())) {
      return std::nullopt;
    }
  }
  bool offers = false;
  transmit_due_ = never;
  const auto keep = [this](const slots::PendingEntry& pending) {
    note_due(pending.due);
    return false;
  };
  std::uint16_t destination = nobody;
  bool full = false;
  pending_.remove_if([&](const slots::PendingEntry& pending) {
    if (full || !is_due(pending.due, now) || (destination != nobody && pending.peer != destination)) {
      return keep(pending);
    }
    // A StopSubscribe and its Subscribe stay together: if only the first fits here, both go into the next.
    const OptionList options{pending, configurations_[pending.configuration]};
    const bool pair_fits =
        !pending.with_next || writer.entry_count() == 0 || writer.fits(2, 2 * options.bytes);
    const bool last_fits =
        !optimised_for_many || writer.entry_count() == 0 || leaves_room(writer, options.bytes);
    const bool written = pair_fits && last_fits && writer.add(pending.entry, options.view());
    if (written) {
      destination = pending.peer;
      offers = offers || (optimised_for_many && pending.entry.kind() == EntryKind::offer_service);
    } else if (writer.entry_count() == 0) {
      count(counters_.unsendable_entries);  // waiting would not help it
    } else {
      full = true;
      return keep(pending);
    }
    if (pending.subscription != slots::Remote::none && pending.entry.ttl_s != 0) {
      subscriptions_[pending.subscription].is_requested = false;
    }
    return true;
  });
  if (writer.entry_count() == 0) {
    return std::nullopt;
  }
  if (optimised_for_many && offers) {
    tell_network(writer);
  }
  const bool multicast = destination == slots::PendingEntry::to_multicast;
  someip::SessionCounter& sessions = multicast ? multicast_sessions_ : peers_[destination].sessions;
  const SessionId session = sessions.next();
  const auto flags = static_cast<std::uint8_t>(
      unicast_flag |                                                         // [feat_req_someipsd_100]
      (sessions.wrapped() ? 0U : reboot_flag) |                              // [feat_req_someipsd_41]
      (settings_.explicit_initial_data ? explicit_initial_data_flag : 0U));  // [feat_req_someipsd_1188]
  const auto client = static_cast<std::uint16_t>(settings_.client_id_prefix << 8U);
  count(counters_.datagrams_sent);
  counters_.entries_sent += writer.entry_count();
  return Transmit{multicast ? settings_.multicast : peers_[destination].endpoint,
                  writer.finish(flags, session, someip::ClientId{client})};
}

std::optional<Happening> ServiceDiscovery::poll_event() noexcept {
  if (guards && is_some_untold_ && events_.empty()) {
    tell_what_is_untold();
  }
  return events_.empty() ? std::nullopt : std::optional{events_.pop()};
}

std::optional<TimePoint> ServiceDiscovery::deadline() const noexcept {
  TimePoint earliest = never;
  const auto consider = [&earliest](TimePoint due) { earliest = earlier(earliest, due); };
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    consider(pending_[i].due);
  }
  for (const slots::Offer& offer : offers_) {
    consider(offer.schedule.deadline());
  }
  for (const slots::Requirement& requirement : requirements_) {
    consider(requirement.schedule.deadline());
  }
  for (const slots::Subscriber& subscription : subscribers_) {
    consider(subscription.expiry);
  }
  for (const slots::Remote& remote : remotes_) {
    consider(remote.expiry);
  }
  for (const slots::Subscription& subscription : subscriptions_) {
    consider(subscription.expiry);
    consider(subscription.silent_at);
  }
  if (guards && link_up_) {
    consider(questions_due_);
  }
  return earliest == never ? std::nullopt : std::optional{earliest};
}

}  // namespace trestle::sd
