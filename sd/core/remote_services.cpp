// The services of peers: what is required, what is offered, the choice among them, and the Finds.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

using slots::Subscription;

bool ServiceDiscovery::fits(const slots::Requirement& requirement,
                            const slots::Remote& remote) const noexcept {
  return requirement.service == remote.service && !remote.is_withheld() &&
         (requirement.instance == someip::any_instance || requirement.instance == remote.instance) &&
         (requirement.major == any_major || requirement.major == remote.major) &&
         (requirement.minor == any_minor || requirement.minor == remote.minor) &&
         has_name(requirement.service, requirement.configuration,
                  otherserv_of(configurations_[remote.configuration]));
}

RemoteService ServiceDiscovery::service_of(const slots::Remote& remote) const noexcept {
  return {remote.service,
          remote.instance,
          remote.major,
          remote.minor,
          remote.udp,
          remote.tcp,
          peers_[remote.peer].endpoint,
          remote.options,
          remotes_.handle_of<RemoteHandle>(remote)};
}

std::optional<RemoteService> ServiceDiscovery::remote(RemoteHandle service) const noexcept {
  const slots::Remote* const slot = remotes_.find(service);
  return slot == nullptr ? std::nullopt : std::optional{service_of(*slot)};
}

std::size_t ServiceDiscovery::requirements_of(const slots::Remote& remote) const noexcept {
  std::size_t count = 0;
  if (const std::span<ServiceId> kept = ids_.requirements; optimised_for_many && !kept.empty()) {
    const std::span<ServiceId> ids = kept.first(requirements_.used_end());
    for (std::size_t at = find_id(ids, remote.service); at != ids.size();
         at = find_id(ids, remote.service, at + 1)) {
      const slots::Requirement& requirement = requirements_[static_cast<std::uint16_t>(at)];
      count += requirement.slot_state == SlotBase::State::in_use && fits(requirement, remote) ? 1 : 0;
    }
    return count;
  }
  for (const slots::Requirement& requirement : requirements_) {
    count += fits(requirement, remote) ? 1 : 0;
  }
  return count;
}

// --- Calls of the application -----------------------------------------------------------------------------

Result<RequirementHandle, SdError> ServiceDiscovery::require(const RequiredService& service,
                                                             TimePoint now) noexcept {
  const bool needs_name = service.service == other_protocols;
  if (!someip::names_a_service(service.service) || service.instance == InstanceId{0} ||
      needs_name == service.otherserv.empty()) {
    return tl::unexpected{SdError::bad_argument};
  }
  std::uint16_t configuration = ConfigurationPool::none;
  if (needs_name) {
    const ConfigurationItem name{otherserv, service.otherserv};
    const auto option = encode_configuration(std::span{&name, 1}, configurations_.room());
    if (!option) {
      return tl::unexpected{SdError::bad_argument};
    }
    configurations_.take(option->body);
    const auto kept = keep_configuration(true);
    if (!kept) {
      return tl::unexpected{SdError::table_full};
    }
    configuration = *kept;
  }
  slots::Requirement* const slot = requirements_.add();
  if (slot == nullptr) {
    return tl::unexpected{SdError::table_full};
  }
  if (const std::span<ServiceId> ids = ids_.requirements; optimised_for_many && !ids.empty()) {
    ids[slot->index] = service.service;
  }
  slot->service = service.service;
  slot->instance = service.instance;
  slot->major = service.major;
  slot->minor = service.minor;
  slot->configuration = configuration;
  // A requirement that is already looked for joins the running Find: there is one Find for all.
  const slots::Requirement* const joined = requirements_.find_if([&](const slots::Requirement& other) {
    return other.schedule.deadline() != never && other.service == slot->service &&
           other.instance == slot->instance && other.major == slot->major &&
           other.configuration == configuration;
  });
  if (joined != nullptr) {
    slot->schedule = joined->schedule;
  } else if (link_up_) {
    start(slot->schedule, now);
  }
  for (slots::Remote& remote : remotes_) {
    remote.is_wanted = remote.is_wanted || fits(*slot, remote);
  }
  slot->told = 0;
  if (!is_some_untold_) {
    tell_known(*slot);
  }
  return requirements_.handle_of<RequirementHandle>(*slot);
}

// A Find for one instance ends with its offer  [feat_req_someipsd_238]; a Find for all instances cannot know
// whether it has found them all  [feat_req_someipsd_239].
void ServiceDiscovery::slow_or_end_finds(slots::Requirement& requirement) noexcept {
  if (requirement.instance == someip::any_instance) {
    requirement.schedule.found_some();
  } else {
    requirement.schedule.found();
  }
}

std::optional<RemoteService> ServiceDiscovery::choose(RequirementHandle handle) noexcept {
  const slots::Requirement* const requirement = requirements_.find(handle);
  if (requirement == nullptr) {
    return std::nullopt;
  }
  const auto is_mute = [](const slots::Remote& remote) {
    return guards && remote.unanswered == slots::Remote::is_mute;
  };
  const auto rank = [&](const slots::Remote& remote) {
    return is_mute(remote) ? LoadBalancingOption{}
                           : remote.options.load_balancing.value_or(settings_.unranked);
  };
  // Lower is better: servers that do not answer come last, servers that have answered come first.
  const auto order = [&](const slots::Remote& remote) {
    std::uint32_t result = rank(remote).priority;
    if constexpr (guards) {
      result += (is_mute(remote) ? 0x20000U : 0U) + (remote.has_answered ? 0U : 0x10000U);
    }
    return result;
  };
  std::uint32_t best = ~0U;
  for (const slots::Remote& remote : remotes_) {
    if (fits(*requirement, remote)) {
      best = std::min(best, order(remote));
    }
  }
  const auto is_candidate = [&](const slots::Remote& remote) {
    return fits(*requirement, remote) && order(remote) == best;
  };
  std::uint64_t weights = 0;
  std::uint64_t candidates = 0;
  for (const slots::Remote& remote : remotes_) {
    if (is_candidate(remote)) {
      weights += rank(remote).weight;
      ++candidates;
    }
  }
  if (candidates == 0) {
    return std::nullopt;
  }
  // If all weights are 0, all servers are equal; otherwise one with weight 0 is never chosen.
  std::uint64_t draw = random_.next() % (weights > 0 ? weights : candidates);
  for (const slots::Remote& remote : remotes_) {
    if (!is_candidate(remote)) {
      continue;
    }
    const std::uint64_t share = weights > 0 ? rank(remote).weight : 1;
    if (draw < share) {
      return service_of(remote);
    }
    draw -= share;
  }
  return std::nullopt;  // not reached: the shares add up
}

ConfigurationCursor ServiceDiscovery::configuration(RemoteHandle handle) const noexcept {
  static constexpr std::array<std::byte, 2> no_items{};
  const slots::Remote* const remote = remotes_.find(handle);
  const bool has_items = remote != nullptr && remote->configuration != ConfigurationPool::none;
  return ConfigurationCursor{
      {OptionType::configuration, has_items ? configurations_[remote->configuration] : ByteView{no_items}}};
}

namespace {

// Whether a user of the service sees no difference between the two.
TRESTLE_ONCE bool same_access(const slots::Remote& a, const slots::Remote& b) noexcept {
  return a.minor == b.minor && are_same(a.udp, b.udp) && are_same(a.tcp, b.tcp) &&
         a.options.mac_groupcast == b.options.mac_groupcast;
}

}  // namespace

// --- Offers of peers --------------------------------------------------------------------------------------

// Offers repeat the name of a service of another protocol; other entries may leave it out.
slots::Remote* ServiceDiscovery::remote_of(const Entry& entry, std::string_view name) const noexcept {
  return search_remotes(entry.service, [&](const slots::Remote& remote) {
    return remote.instance == entry.instance && remote.major == entry.major &&
           (name.empty() || has_name(remote.service, remote.configuration, name));
  });
}

bool ServiceDiscovery::read_offer(const Entry& entry, const Arrival& arrival,
                                  slots::Remote& offered) noexcept {
  const auto options = read_options(arrival.message, entry, rules_);
  if (!options || entry.instance == someip::any_instance) {
    count(counters_.ignored_bad_options);
    return false;
  }
  if (guards && is_foreign(*options, arrival)) {
    count(counters_.ignored_foreign_endpoints);
    return false;
  }
  const MergedConfiguration merged = merge_configurations(arrival.message, entry, configurations_.room());
  if (!merged.whole) {
    count(counters_.configurations_cut);
    note(Limit::configuration_bytes);
  }
  offered.service = entry.service;
  offered.instance = entry.instance;
  offered.major = entry.major;
  offered.minor = entry.minor();
  offered.peer = arrival.peer;
  offered.udp = options->udp;
  offered.tcp = options->tcp;
  offered.options = options->offer;
  offered.configuration = configurations_.take(merged.body);
  const bool is_other = entry.service == other_protocols;
  if (!is_other) {
    offered.options.mac_groupcast.reset();
  }
  const bool is_named = !is_other || !otherserv_of(merged.body).empty();  // [feat_req_someipsd_500]
  // An offer without endpoint tells nobody how to reach the service. [feat_req_someipsd_503]
  // [feat_req_someipsd_681]
  const bool is_good = is_named && (offered.udp || offered.tcp || offered.options.mac_groupcast);
  counters_.ignored_bad_options += is_good ? 0 : 1;
  return is_good;
}

// False when there is no room for the configuration and the service cannot be identified without it.
bool ServiceDiscovery::keep_configuration_of(slots::Remote& offered, bool required) noexcept {
  const auto kept = keep_configuration(required);
  if (!kept) {
    count(counters_.configurations_cut);
    note(Limit::configurations);
  }
  offered.configuration = kept.value_or(ConfigurationPool::none);
  return kept || offered.service != other_protocols;
}

// A place for a service that is offered for the first time; null, and said, when there is none.
slots::Remote* ServiceDiscovery::add_remote(slots::Remote& offered, bool is_taken_over,
                                            const Arrival& arrival) noexcept {
  const std::size_t wanting = requirements_of(offered);
  if (!guards && event_places() < wanting) {
    refuse(Limit::pending_events);
    return nullptr;
  }
  slots::Remote* const remote = new_remote(wanting, arrival);
  if (remote == nullptr) {
    refuse(is_guest(arrival.peer) ? Limit::peers : Limit::remote_services);
    return nullptr;
  }
  static_cast<SlotBase&>(offered) = static_cast<const SlotBase&>(*remote);
  *remote = offered;
  if (const std::span<ServiceId> ids = ids_.remotes; optimised_for_many && !ids.empty()) {
    ids[remote->index] = remote->service;
  }
  remote->is_wanted = wanting > 0;
  ++peers_[remote->peer].remotes;
  if constexpr (guards) {
    recall(*remote, arrival.now);
    taken_over_ = is_taken_over ? remote->index : taken_over_;
  }
  return remote;
}

// Of a gateway to the network that we are a gateway to, see be_gateway_to().
inline bool ServiceDiscovery::tells_our_network(const SdMessage& message) const noexcept {
  for (const std::optional<Endpoint>& network : gateway_to_) {
    OptionCursor options = message.options();
    while (const auto option = network ? options.next() : std::nullopt) {
      const auto told = EndpointOption::decode(*option);
      if (told && told->role == EndpointRole::multicast && told->endpoint == *network) {
        return true;
      }
    }
  }
  return false;
}

void ServiceDiscovery::on_offer(const Entry& entry, const Arrival& arrival) noexcept {
  slots::Remote offered;
  if ((optimised_for_many && !is_allowed(entry, arrival)) || !read_offer(entry, arrival, offered)) {
    return;
  }
  // This may forget services that nobody requires, so it comes before the search for this one.
  if (offered.configuration != ConfigurationPool::none &&
      !keep_configuration_of(offered, requirements_of(offered) > 0)) {
    refuse(Limit::configurations);
    return;
  }
  slots::Remote* remote = remote_of(entry, otherserv_of(configurations_[offered.configuration]));
  bool is_taken_over = false;
  if (remote != nullptr && remote->peer != arrival.peer) {
    if (!takes_over(offered, *remote, arrival)) {
      return;
    }
    is_taken_over = true;
    remote = nullptr;
  }
  const bool replaced = remote != nullptr && !same_access(*remote, offered);
  const bool updated = remote != nullptr &&
                       (remote->configuration != offered.configuration || remote->options != offered.options);
  if (replaced && !may_go_on(arrival.peer, 1, arrival.now)) {
    return;
  }
  if (replaced) {
    lose(*remote, LossReason::replaced, arrival.now);
    remote = nullptr;
  }
  if (remote != nullptr && updated && event_places() < requirements_of(*remote)) {
    refuse(Limit::pending_events);
    return;
  }
  const bool is_new = remote == nullptr;
  if (is_new) {
    remote = add_remote(offered, is_taken_over, arrival);
    if (remote == nullptr) {
      return;
    }
    for (bool& withheld : remote->withheld) {
      withheld = tells_our_network(arrival.message);
    }
  }
  remote->goes_on = remote->goes_on || remote->is_asked || remote->unanswered != 0;
  remote->options = offered.options;
  remote->configuration = offered.configuration;
  remote->expiry = end_of(entry.ttl_s, arrival.now);
  remote->answer_due = arrival.answer_due;
  if (is_new || updated) {
    ++remote_changes_;
  }
  if (is_new && remote->is_wanted) {
    remote->announced = 0;
    if (!is_some_untold_) {
      tell_new(*remote);
    }
  } else if (updated) {
    announce(*remote);
  }
  renew_subscriptions(*remote, is_new, arrival);
}

// --- Gateways to the same network -------------------------------------------------------------------------

void ServiceDiscovery::admit(const RemoteHandle& service, TimePoint now) noexcept {
  if (!optimised_for_many) {
    return;  // nothing ever is
  }
  slots::Remote* const remote = remotes_.find(service);
  if (remote == nullptr || !remote->is_withheld()) {
    return;
  }
  remote->withheld = {};
  remote->is_wanted = requirements_of(*remote) > 0;
  ++remote_changes_;
  if (!remote->is_wanted) {
    return;
  }
  remote->announced = 0;
  if (!is_some_untold_) {
    tell_new(*remote);
  }
  // As if it were offered only now.
  const SdMessage message{};
  renew_subscriptions(*remote, true,
                      {message, peers_[remote->peer].endpoint.address, remote->peer, false, now, now});
}

void ServiceDiscovery::remove(slots::Remote& remote) noexcept {
  ++remote_changes_;
  --peers_[remote.peer].remotes;
  remotes_.remove(remote);
}

void ServiceDiscovery::announce(const slots::Remote& remote) noexcept {
  for (slots::Requirement& requirement : requirements_) {
    tell_available(requirement, remote);
  }
}

// Reports the service if the requirement matches it.
void ServiceDiscovery::tell_available(slots::Requirement& requirement, const slots::Remote& remote) noexcept {
  if (fits(requirement, remote)) {
    slow_or_end_finds(requirement);
    tell([&] {
      return ServiceAvailable{requirements_.handle_of<RequirementHandle>(requirement), service_of(remote)};
    });
  }
}

void ServiceDiscovery::on_stop_offer(const Entry& entry, const Arrival& arrival) noexcept {
  if (!may_go_on(arrival.peer, 1, arrival.now)) {
    return;  // in a flood not each is worth a search
  }
  slots::Remote* const remote = remote_of(entry, name_in(entry, arrival));
  if (remote == nullptr || remote->peer != arrival.peer) {
    return;
  }
  lose(*remote, LossReason::stopped, arrival.now);  // [feat_req_someipsd_831]
}

void ServiceDiscovery::lose(slots::Remote& remote, LossReason reason, TimePoint now) noexcept {
  if constexpr (guards) {
    if (remote.is_asked) {
      remember(remote);
    }
    note_held(remote);
  }
  while (remote.subscribed_by != slots::Remote::none) {
    leave_remote(subscriptions_[remote.subscribed_by], reason);
  }
  remote.told() = 0;
  Table<slots::Remote>::lose(remote, reason);
  ++remote_changes_;
  // After a StopOffer wait for the next offer without asking.  [feat_req_someipsd_834]
  const bool ask = link_up_ && (reason == LossReason::expired || reason == LossReason::rebooted);
  for (slots::Requirement& requirement : requirements_) {
    if (!ask || !remote.is_wanted) {
      break;
    }
    if (fits(requirement, remote) &&
        remotes_.find_if([&](const slots::Remote& other) { return fits(requirement, other); }) == nullptr) {
      start(requirement.schedule, now);
    }
  }
  tell_loss(remote);
}

// Advances Finds and ends offers whose TTL is over. What has no room stays due.
void ServiceDiscovery::seek(TimePoint now) noexcept {
  const bool are_asked = guards && is_due(questions_due_, now);
  if (are_asked) {
    questions_due_ = never;
  }
  for (slots::Remote& remote : remotes_) {
    if (are_asked && remote.is_contested) {
      static_cast<void>(gives_way(remote, now));
    }
    if (is_due(remote.expiry, now) && (guards || events_.free_places() > requirements_of(remote))) {
      lose(remote, LossReason::expired, now);
    }
  }
  for (slots::Requirement& requirement : requirements_) {
    if (pending_.free_places() == 0 || !requirement.schedule.on_time(now)) {
      continue;
    }
    bool is_there = false;  // queued for another requirement
    for (std::size_t i = 0; i < pending_.size() && !is_there; ++i) {
      const slots::PendingEntry& other = pending_[i];
      is_there = (!guards || other.peer == slots::PendingEntry::to_multicast) &&
                 other.entry.type == EntryType::find_service && other.entry.service == requirement.service &&
                 other.entry.instance == requirement.instance && other.entry.major == requirement.major &&
                 other.configuration == requirement.configuration;
    }
    if (is_there) {
      continue;
    }
    fill_find(*send(slots::PendingEntry::to_multicast, now), requirement);
  }
}

}  // namespace trestle::sd
