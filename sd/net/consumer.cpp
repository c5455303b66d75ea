#include "sd/net/consumer.hpp"

#include <stdexcept>

#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::sd {

using someip::CallHandle;

namespace {

bool same(const RemoteService& a, const RemoteService& b) {
  return a.service == b.service && a.instance == b.instance && a.major == b.major;
}

}  // namespace

Consumer::Consumer(boost::asio::io_context& io, ServiceDiscovery& discovery, Ports& ports,
                   const NodeConfig& config, NodeCounters& counters, DiscoveryLog log, DiscoveryLog warn,
                   std::function<void()> changed)
    : io_{io},
      discovery_{discovery},
      ports_{ports},
      config_{config},
      counters_{counters},
      log_{std::move(log)},
      warn_{std::move(warn)},
      changed_{std::move(changed)},
      call_slots_(config.max_calls),
      calls_{call_slots_, config.client},
      waiting_(config.max_calls),
      asked_(config.max_calls),
      call_timer_{io, [this] {
                    calls_.on_time(now(), [this](CallHandle call) { time_out(call); });
                    call_timer_.arm(calls_.deadline());
                  }} {}

// --- Requirements -----------------------------------------------------------------------------------------

RequirementHandle Consumer::look_for(const RequireSpec& spec, TimePoint now) {
  const auto handle = discovery_.require({.service = spec.service,
                                          .instance = spec.instance,
                                          .major = spec.major,
                                          .minor = spec.minor,
                                          .otherserv = spec.otherserv},
                                         now);
  if (!handle) {
    throw std::invalid_argument{"requirement of " + to_string(spec.service, spec.instance) +
                                ": refused by service discovery: " +
                                refusal_text(handle.error(), "max_requirements, max_configurations")};
  }
  if (!any_search(spec.service,
                  [&](const Search& search) { return search.spec.instance == spec.instance; })) {
    log_("looking for " + to_string(spec.service, spec.instance));
  }
  return *handle;
}

RequirementId Consumer::require(const RequireSpec& spec, AvailabilityHandler handler, TimePoint now) {
  if (const std::string mistake = mistake_in(spec, config_); !mistake.empty()) {
    throw std::invalid_argument{"requirement of " + to_string(spec.service, spec.instance) + ": " + mistake};
  }
  const auto requirement = std::make_shared<Requirement>();
  requirement->e2e = channels_of(spec);
  if (!call_port_) {
    call_port_ = ports_.udp(0);
  }
  requirement->handle = look_for(spec, now);
  requirement->spec = spec;
  requirement->id = RequirementId{next_id_++};
  requirement->handler = std::move(handler);
  requirements_.push_back(requirement);
  add(*requirement, {.requirement = requirement});
  return requirement->id;
}

void Consumer::release(RequirementId id, TimePoint now) {
  if (const auto requirement = find(id)) {
    discovery_.release(requirement->handle, now);
    remove(*requirement);
    std::erase(requirements_, requirement);
  }
}

std::vector<RemoteService> Consumer::available(RequirementId id) const {
  const auto requirement = find(id);
  return requirement ? requirement->servers : std::vector<RemoteService>{};
}

std::shared_ptr<Consumer::Requirement> Consumer::find(RequirementId id) const {
  const auto found = std::ranges::lower_bound(requirements_, id, {}, &Requirement::id);
  return found == requirements_.end() || (*found)->id != id ? nullptr : *found;
}

Consumer::Requirer Consumer::find(RequirementHandle handle) const {
  if (handle.index >= requirers_.size()) {
    return {};
  }
  const Requirer& there = requirers_[handle.index];
  const Search* const search =
      there.subscription ? static_cast<const Search*>(there.subscription.get()) : there.requirement.get();
  return search != nullptr && search->handle == handle ? there : Requirer{};
}

void Consumer::add(Search& search, Requirer requirer) {
  searches_[search.spec.service].push_back(&search);
  requirers_.resize(std::max<std::size_t>(requirers_.size(), search.handle.index + 1U));
  requirers_[search.handle.index] = std::move(requirer);
}

void Consumer::remove(Search& search) {
  perhaps_unneeded_ = true;
  std::erase(with_others_, &search);
  const auto searches = searches_.find(search.spec.service);
  std::erase(searches->second, &search);
  if (searches->second.empty()) {
    searches_.erase(searches);
  }
  requirers_[search.handle.index] = {};  // may end it
}

// --- TCP connections --------------------------------------------------------------------------------------

Consumer::Connection& Consumer::connection_to(const Endpoint& remote) {
  Connection& connection = connections_[remote];
  if (!connection.client) {
    connection.client = ports_.connect(
        remote, {.message = {},
                 .connected = [this, remote](const Endpoint&) { connected(remote); },
                 .disconnected = [this, remote](const std::string& why) { disconnected(remote, why); }});
  }
  return connection;
}

void Consumer::connected(const Endpoint& remote) {
  for (const auto& subscription : subscriptions_) {
    for (const RemoteService& server : subscription->servers) {
      if (server.tcp == remote && subscription->wanted.tcp) {
        subscribe_at(*subscription, server, now());
      }
    }
  }
  changed_();
}

// Who offers it there cannot even be asked.
void Consumer::note_not_connected(const Endpoint& remote) {
  const auto note = [&](const Search& search) {
    const auto server = std::ranges::find(search.servers, std::optional{remote}, &RemoteService::tcp);
    if (server != search.servers.end()) {
      discovery_.not_answered(server->handle);
    }
    return server != search.servers.end();
  };
  const auto connection = connections_.find(remote);
  const bool is_called = connection != connections_.end() && connection->second.called;
  const bool is_noted =
      std::ranges::any_of(subscriptions_, [&](const auto& one) { return one->wanted.tcp && note(*one); });
  for (auto one = requirements_.begin(); is_called && !is_noted && one != requirements_.end(); ++one) {
    if (note(**one)) {
      break;
    }
  }
}

// A subscription is worth nothing without the connection that it named: it is made anew with the next one.
void Consumer::disconnected(const Endpoint& remote, const std::string& why) {
  log_(why);
  note_not_connected(remote);
  for (const auto& subscription : subscriptions_) {
    for (AtServer& at_server : subscription->at_servers) {
      if (at_server.connection == remote) {
        unsubscribe_at(at_server, now());
      }
    }
  }
  calls_.connection_lost({remote, Transport::tcp}, [this](CallHandle call) { time_out(call); });
  call_timer_.arm(calls_.deadline());
  changed_();
}

// Ends the connection from our side.
void Consumer::disconnect(const Endpoint& remote) {
  const auto found = connections_.find(remote);
  if (found == connections_.end()) {
    return;
  }
  past_connections_ += found->second.client->counters();
  connections_.erase(found);
  calls_.connection_lost({remote, Transport::tcp}, [this](CallHandle call) { time_out(call); });
  call_timer_.arm(calls_.deadline());
}

bool Consumer::is_needed(const Endpoint& remote, const Connection& connection) const {
  const auto is_there = [&](const RemoteService& server) { return server.tcp == remote; };
  return (connection.called &&
          std::ranges::any_of(
              requirements_, [&](const auto& one) { return std::ranges::any_of(one->servers, is_there); })) ||
         std::ranges::any_of(subscriptions_, [&](const auto& one) {
           return one->wanted.tcp && std::ranges::any_of(one->servers, is_there);
         });
}

void Consumer::end_unneeded(TimePoint now) {
  if (!std::exchange(perhaps_unneeded_, false)) {
    return;
  }
  // What is subscribed to wherever it is offered is forgotten with the offer: else our tables could fill.
  for (const auto& subscription : subscriptions_) {
    if (subscription->spec.instance == someip::any_instance) {
      std::erase_if(subscription->at_servers, [&](AtServer& at_server) {
        const bool gone = std::ranges::find(subscription->servers, at_server.instance,
                                            &RemoteService::instance) == subscription->servers.end();
        if (gone) {
          unsubscribe_at(at_server, now);
        }
        return gone;
      });
    }
  }
  // [feat_req_someip_678] [feat_req_someip_679]
  std::vector<Endpoint> unneeded;
  for (const auto& [remote, connection] : connections_) {
    if (!is_needed(remote, connection)) {
      unneeded.push_back(remote);
    }
  }
  for (const Endpoint& remote : unneeded) {
    disconnect(remote);
  }
}

void Consumer::clear() {
  searches_.clear();
  with_others_.clear();
  requirers_.clear();
  owners_.clear();
  requirements_.clear();
  for (const auto& subscription : subscriptions_) {
    for (const auto& listener : subscription->listeners) {
      listener->active = false;  // it may be in line, if a handler does this
    }
  }
  subscriptions_.clear();
  wishes_.clear();
  by_service_.clear();
  connections_.clear();
}

// --- Other versions ---------------------------------------------------------------------------------------

void Consumer::note_other_versions() {
  std::vector<Search*> concerned = std::exchange(with_others_, {});
  discovery_.for_each_remote([&](const slots::Remote& remote) {
    const auto searches = searches_.find(remote.service);
    if (searches == searches_.end()) {
      return;
    }
    for (Search* const search : searches->second) {
      const RequireSpec& wanted = search->spec;
      const bool is_right = (wanted.major == any_major || wanted.major == remote.major) &&
                            (wanted.minor == any_minor || wanted.minor == remote.minor);
      if (is_right || !search->servers.empty() || !wanted.otherserv.empty() ||
          (wanted.instance != someip::any_instance && wanted.instance != remote.instance)) {
        continue;
      }
      if (search->others.empty() && search->seen.empty()) {
        concerned.push_back(search);
      }
      search->seen.push_back(discovery_.service_of(remote));
    }
  });
  for (Search* const search : concerned) {
    warn_of_others(*search);
    if (!search->others.empty()) {
      with_others_.push_back(search);
    }
  }
}

void Consumer::warn_of_others(Search& search) {
  const RequireSpec& wanted = search.spec;
  const std::vector<RemoteService> others = std::exchange(search.seen, {});
  std::vector<RemoteHandle> handles(others.size());
  std::ranges::transform(others, handles.begin(), &RemoteService::handle);
  const std::vector<RemoteHandle> known = std::exchange(search.others, std::move(handles));
  for (const RemoteService& other : others) {
    if (std::ranges::find(known, other.handle) != known.end()) {
      continue;
    }
    ++search.faults.other_version;
    const bool is_said = any_search(wanted.service, [&](const Search& one) {
      return &one != &search && one.spec.major == wanted.major && one.spec.minor == wanted.minor &&
             std::ranges::find(one.others, other.handle) != one.others.end();
    });
    if (!is_said) {
      warn_(to_string(other.service, other.instance) + " is wanted in version " +
            version_text(wanted.major, wanted.minor) + ", but " + someip::to_string(other.peer.address) +
            " offers it in version " + version_text(other.major, other.minor));
    }
  }
}

// --- What discovery tells ---------------------------------------------------------------------------------

void Consumer::on_event(const ServiceAvailable& event, TimePoint now) {
  perhaps_unneeded_ = true;
  if (!any_search(event.service.service, [&](const Search& search) {
        return std::ranges::find(search.servers, event.service) != search.servers.end();
      })) {
    log_(describe(event.service));
  }
  const auto note = [&](Search& search) {
    std::erase_if(search.servers, [&](const RemoteService& known) { return same(known, event.service); });
    search.servers.push_back(event.service);
  };
  const auto [subscription, requirement] = find(event.requirement);  // kept: a handler may end it
  if (subscription) {
    note(*subscription);
    subscribe_at(*subscription, event.service, now);
  }
  if (requirement) {
    note(*requirement);
    if (requirement->handler) {
      requirement->handler(event.service, true);
    }
  }
}

void Consumer::on_event(const ServiceLost& event) {
  const auto is_it = [&](const RemoteService& known) { return same(known, event.service); };
  perhaps_unneeded_ = true;
  const auto [subscription, requirement] = find(event.requirement);  // kept: a handler may end it
  if (subscription) {
    std::erase_if(subscription->servers, is_it);
    const auto at_server =
        std::ranges::find(subscription->at_servers, event.service.instance, &AtServer::instance);
    if (at_server != subscription->at_servers.end()) {
      at_server->not_over_tcp = false;
    }
    for (const auto& listener : subscription->listeners) {
      listener->e2e.forget(event.service.udp, event.service.tcp);
    }
  }
  if (requirement) {
    std::erase_if(requirement->servers, is_it);
    requirement->e2e.forget(event.service.udp, event.service.tcp);
  }
  if (!any_search(event.service.service,
                  [&](const Search& search) { return std::ranges::any_of(search.servers, is_it); })) {
    log_("service " + to_string(event.service.service, event.service.instance) + " of " +
         someip::to_string(event.service.peer.address) + " is gone: " + to_string(event.reason));
  }
  // Whoever restarted knows nothing of the connection.  [feat_req_someipsd_872]
  if (event.reason == LossReason::rebooted && event.service.tcp) {
    disconnect(*event.service.tcp);
  }
  if (requirement && requirement->handler) {
    requirement->handler(event.service, false);
  }
}

someip::TcpClient::Counters Consumer::tcp_counters() const {
  someip::TcpClient::Counters sum = past_connections_;
  for (const auto& [remote, connection] : connections_) {
    sum += connection.client->counters();
  }
  return sum;
}

}  // namespace trestle::sd
