#include "dds_adapter/participant_core.hpp"

#include <algorithm>

#include "dds_adapter/policies.hpp"
#include "dds_adapter/polled_udp.hpp"
#include "dds_adapter/raw_type.hpp"
#include "dds_adapter/ros_names.hpp"
#include "dds_adapter/socket_buffers.hpp"

namespace trestle::dds::detail {

namespace {

constexpr std::uint32_t max_domain = 232;  // the highest whose ports, from 7400 + 250 * domain, fit 16 bits

template <typename Octets>
std::string hex_digits(const Octets& octets, std::size_t size) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string result;
  for (std::size_t i = 0; i < size; ++i) {
    const auto octet = static_cast<unsigned>(octets[i]);
    result += digits[octet >> 4U];
    result += digits[octet & 15U];
  }
  return result;
}

}  // namespace

std::string to_hex(const fast::Prefix& prefix) {
  return hex_digits(prefix.value, 12);
}

std::string to_hex(const fast::Guid& guid) {
  return to_hex(guid.guidPrefix) + hex_digits(guid.entityId.value, 4);
}

Guid to_guid(const fast::Guid& guid) noexcept {
  Guid result{};
  const auto prefix = std::as_bytes(std::span{guid.guidPrefix.value});
  const auto entity = std::as_bytes(std::span{guid.entityId.value});
  std::ranges::copy(entity, std::ranges::copy(prefix, result.begin()).out);
  return result;
}

fast::Guid to_fast(const Guid& guid) noexcept {
  fast::Guid result;
  const auto prefix = std::as_writable_bytes(std::span{result.guidPrefix.value});
  const auto entity = std::as_writable_bytes(std::span{result.entityId.value});
  std::ranges::copy(std::span{guid}.first(prefix.size()), prefix.begin());
  std::ranges::copy(std::span{guid}.last(entity.size()), entity.begin());
  return result;
}

ParticipantCore::ParticipantCore(const ParticipantConfig& config)
    : sockets_{config.polled ? std::make_shared<SampleSockets>() : nullptr},
      graph_{config, [this] { on_names(); }},
      strict_types_{config.strict_types},
      frees_samples_{config.frees_samples},
      on_event_{config.on_event},
      on_writers_{config.on_writers} {
  fast::link_type_object_guard();
  fast::link_rediscovery_guard();
  fast::link_listener_guard();
  fast::link_sanitizer_hints();
  if (config.domain > max_domain) {
    throw DdsError{"DDS domain " + std::to_string(config.domain) + " is out of range: 0 to " +
                   std::to_string(max_domain)};
  }
  if (config.lease < std::chrono::milliseconds{100} || config.lease > std::chrono::hours{24}) {
    throw DdsError{"the lease of a DDS participant is from 100 ms to 24 h"};
  }
  const fast::DomainParticipantQos qos = participant_qos(config, sockets_);
  // Discovery callbacks come from now on, whatever the mask says.
  auto* factory = fast::DomainParticipantFactory::get_instance();
  participant_ = factory->create_participant(config.domain, qos, this, fast::StatusMask::none());
  if (participant_ == nullptr) {
    throw DdsError{"Fast DDS could not make a participant in domain " + std::to_string(config.domain) +
                   "; see its own message on standard error (are all ports of the domain taken?)"};
  }
  prefix_ = participant_->guid().guidPrefix;
  if (strict_types_) {
    fast::refuse_readers_of_other_types(prefix_);
  }
  large_sample_ = needs_larger_send_buffer(send_buffer_wanted()).value_or(never_large);
  publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    destroy();
    throw DdsError{"Fast DDS could not make a publisher and a subscriber"};
  }
  if (graph_.is_wanted()) {
    try {
      graph_.open(participant_->guid(), *publisher_, *subscriber_, *use_topic(graph_topic, graph_type));
    } catch (const DdsError&) {
      destroy();
      throw;
    }
  }
}

ParticipantCore::~ParticipantCore() {
  destroy();
}

void ParticipantCore::destroy() noexcept {
  fast::forget_refusals(prefix_);
  graph_.close();
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

bool ParticipantCore::shares_memory() const {
  return std::ranges::any_of(participant_->get_qos().transport().user_transports, [](const auto& transport) {
    return dynamic_cast<const eprosima::fastdds::rtps::SharedMemTransportDescriptor*>(transport.get()) !=
           nullptr;
  });
}

std::uint32_t ParticipantCore::send_buffer_wanted() const {
  std::uint32_t bytes = 0;
  for (const auto& transport : participant_->get_qos().transport().user_transports) {
    if (const auto* udp = udp_of(*transport)) {
      bytes = std::max(bytes, udp->sendBufferSize);
    }
  }
  return bytes;
}

void ParticipantCore::on_large_sample() {
  if (large_sample_.exchange(never_large) != never_large) {
    if (const auto line = detail::send_buffer_not_granted(send_buffer_wanted())) {
      report({Happening::Kind::small_send_buffer, "", "", "", *line, 0});
    }
  }
}

std::vector<std::string> ParticipantCore::buffers_not_granted() const {
  std::uint32_t receive_bytes = 0;
  for (const auto& transport : participant_->get_qos().transport().user_transports) {
    if (const auto* udp = udp_of(*transport)) {
      const std::uint32_t wanted = udp->receiveBufferSize;
      const bool has_all = is_polled(*transport) && granted_receive_buffer(wanted) >= wanted;
      receive_bytes = std::max(receive_bytes, has_all ? 0 : wanted);
    }
  }
  const auto line = detail::receive_buffer_not_granted(receive_bytes);
  return line ? std::vector{*line} : std::vector<std::string>{};
}

fast::Topic* ParticipantCore::use_topic(const std::string& topic, const std::string& type) {
  // Creating topics and types runs no callbacks, so the lock may be held.
  const std::lock_guard lock{mutex_};
  UsedTopic& used = topics_[topic];
  if (used.users == 0) {
    fast::TypeSupport support = participant_->find_type(type);
    if (support.empty()) {
      support.reset(new RawType{type});
      if (!fast::is_ok(support.register_type(participant_))) {
        topics_.erase(topic);
        throw DdsError{"Fast DDS refuses the type name '" + type + "' of topic '" + topic + "'"};
      }
    }
    used.topic = participant_->create_topic(topic, type, fast::TOPIC_QOS_DEFAULT);
    if (used.topic == nullptr) {
      topics_.erase(topic);
      throw DdsError{"Fast DDS refuses the topic '" + topic + "' of type '" + type + "'"};
    }
    used.type = type;
  } else if (used.type != type) {
    throw DdsError{"topic '" + topic + "' is already in use with type '" + used.type +
                   "', so it can't have type '" + type + "'"};
  }
  ++used.users;
  return used.topic;
}

void ParticipantCore::drop_topic(const std::string& topic) noexcept {
  const std::lock_guard lock{mutex_};
  const auto used = topics_.find(topic);
  if (used != topics_.end() && --used->second.users == 0) {
    participant_->delete_topic(used->second.topic);
    topics_.erase(used);
  }
}

namespace {

/// Both are of one participant, where a topic has only one type.
bool are_matched(const ParticipantCore::Endpoint& one, const ParticipantCore::Endpoint& other) {
  return one.topic == other.topic && one.writer != other.writer &&
         (one.writer ? differing_policies(one.qos, other.qos) : differing_policies(other.qos, one.qos))
             .empty();
}

}  // namespace

std::size_t ParticipantCore::Endpoint::foreign(std::int32_t count) const noexcept {
  const std::size_t not_counted = *own_matches + ignored_matches->count();
  const auto all = static_cast<std::size_t>(std::max(count, 0));
  return all > not_counted ? all - not_counted : 0;
}

void ParticipantCore::count_own_matches(const Endpoint& endpoint) const {
  const std::lock_guard lock{mutex_};
  *endpoint.own_matches = static_cast<std::size_t>(std::ranges::count_if(
      endpoints_, [&](const Endpoint* other) { return are_matched(endpoint, *other); }));
}

void ParticipantCore::add(const Endpoint* endpoint, const fast::Guid& guid) {
  std::vector<Happening> events;
  {
    const std::lock_guard lock{mutex_};
    std::size_t own_matches = 0;
    for (const Endpoint* other : endpoints_) {
      if (are_matched(*endpoint, *other)) {
        ++*other->own_matches;
        ++own_matches;
      }
    }
    *endpoint->own_matches = own_matches;
    endpoints_.push_back(endpoint);
    for (auto& [peer, known] : found_) {
      const fast::FoundEndpoint& found = known.endpoint;
      note_unserved(*endpoint, known, events);
      note_hash(*endpoint, known, events);
      if (found.topic == endpoint->topic && found.type != endpoint->type &&
          found.writer != endpoint->writer) {
        events.push_back({Happening::Kind::incompatible_type, endpoint->topic, endpoint->type, to_hex(peer),
                          found.type, 0});
      }
    }
  }
  graph_.add(guid, endpoint->writer);
  report(events);
}

void ParticipantCore::remove(const Endpoint* endpoint, const fast::Guid& guid) noexcept {
  graph_.remove(guid);
  const std::lock_guard lock{mutex_};
  std::erase(endpoints_, endpoint);
  for (const Endpoint* other : endpoints_) {
    if (are_matched(*endpoint, *other)) {
      --*other->own_matches;
    }
  }
  for (auto& [peer, found] : found_) {
    std::erase(found.told, endpoint);
    std::erase(found.refused_by, endpoint);
  }
}

Vendor ParticipantCore::vendor(const fast::Prefix& participant) const {
  constexpr std::array<std::uint8_t, 2> eprosima{0x01, 0x0f};
  constexpr std::array<std::uint8_t, 2> eclipse{0x01, 0x10};
  // Prefixes begin with the vendor id, except those that users choose, for example for discovery servers.
  std::array<std::uint8_t, 2> id{participant.value[0], participant.value[1]};
  {
    const std::lock_guard lock{mutex_};
    if (const auto known = peers_.find(participant); known != peers_.end()) {
      id = known->second.vendor;
    }
  }
  return id == eprosima ? Vendor::fast_dds : id == eclipse ? Vendor::cyclone_dds : Vendor::other;
}

void ParticipantCore::report(const Happening& happening) {
  const std::lock_guard lock{event_gate_};
  if (on_event_) {
    on_event_(happening);
  }
}

void ParticipantCore::report(const std::vector<Happening>& events) {
  for (const Happening& happening : events) {
    report(happening);
  }
}

void ParticipantCore::report(Happening::Kind kind, const Endpoint& endpoint, const std::string& peer,
                             std::size_t matched) {
  report({kind, endpoint.topic, endpoint.type, peer, endpoint.writer ? "writer" : "reader", matched});
}

bool ParticipantCore::note_match(const Endpoint& endpoint, const fast::Guid& peer,
                                 const fast::MatchedStatus& status, std::atomic<std::int32_t>& matched) {
  const bool is_new = status.current_count_change > 0;
  const bool ignored = endpoint.ignored_matches->change(peer, is_new, ignores(endpoint, peer));
  matched = status.current_count;
  if (is_own(peer)) {
    return false;
  }
  report(is_new ? Happening::Kind::matched : Happening::Kind::unmatched, endpoint, to_hex(peer),
         endpoint.foreign(status.current_count));
  return !ignored;
}

namespace {

bool are_counterparts(const ParticipantCore::Endpoint& ours, const fast::FoundEndpoint& peer) {
  return peer.topic == ours.topic && peer.type == ours.type && peer.writer != ours.writer;
}

/// The policies that keep counterparts from matching; empty if there are none.
std::string policies_between(const ParticipantCore::Endpoint& ours, const fast::FoundEndpoint& peer) {
  return ours.writer ? differing_policies(ours.qos, peer.qos) : differing_policies(peer.qos, ours.qos);
}

/// The policies that one wants and the other does not really offer, even if what ours announces matches.
std::string unmet_policies(const ParticipantCore::Endpoint& ours, const fast::FoundEndpoint& peer) {
  if (ours.unserved == nullptr) {
    return policies_between(ours, peer);
  }
  Qos offered = ours.qos;
  offered.transient_local = false;
  return differing_policies(offered, peer.qos);
}

}  // namespace

void ParticipantCore::note_unserved(const Endpoint& endpoint, Found& found,
                                    std::vector<Happening>& events) const {
  const fast::FoundEndpoint& peer = found.endpoint;
  if (endpoint.unserved == nullptr || is_own(peer.guid) || !are_counterparts(endpoint, peer) ||
      !policies_between(endpoint, peer).empty() || unmet_policies(endpoint, peer).empty() ||
      std::ranges::find(found.told, &endpoint) != found.told.end()) {
    return;
  }
  found.told.push_back(&endpoint);
  ++*endpoint.unserved;
  events.push_back(incompatible(endpoint, found));
}

void ParticipantCore::note_hash(const Endpoint& endpoint, Found& found, std::vector<Happening>& events) {
  const fast::FoundEndpoint& peer = found.endpoint;
  if (is_own(peer.guid) || !are_counterparts(endpoint, peer) ||
      !have_other_type_hashes(endpoint.user_data, peer.user_data)) {
    return;
  }
  if (strict_types_ && std::ranges::find(found.refused_by, &endpoint) == found.refused_by.end()) {
    found.refused_by.push_back(&endpoint);
    if (endpoint.refused != nullptr) {
      ++*endpoint.refused;
    }
  }
  if (found.other_hash) {
    return;
  }
  Happening happening{Happening::Kind::other_type_hash,
                      endpoint.topic,
                      endpoint.type,
                      to_hex(peer.guid),
                      std::string{user_data_value(peer.user_data, "typehash")},
                      0};
  happening.node = graph_.node_of(peer.guid);
  happening.ours_reads = !endpoint.writer;
  happening.hash = user_data_value(endpoint.user_data, "typehash");
  happening.refused = strict_types_;
  found.other_hash = happening;
  events.push_back(std::move(happening));
}

bool ParticipantCore::refuses(const Endpoint& ours, const fast::Guid& peer) const {
  if (!strict_types_ || is_own(peer)) {
    return false;
  }
  const std::lock_guard lock{mutex_};
  const auto found = found_.find(peer);
  return found != found_.end() && have_other_type_hashes(ours.user_data, found->second.endpoint.user_data);
}

bool ParticipantCore::ignores(const Endpoint& ours, const fast::Guid& peer) const {
  return (ours.bridge && judge(bridge_ends_, peer, ours.takes_bridge) == OtherEnd::ignored) ||
         refuses(ours, peer);
}

bool ParticipantCore::has_reliable_reader(const Endpoint& writer) const {
  const std::lock_guard lock{mutex_};
  return not_remembered_ > 0 || std::ranges::any_of(found_, [&](const auto& known) {
           const fast::FoundEndpoint& peer = known.second.endpoint;
           return peer.qos.reliable && known.second.refused_by.empty() && are_counterparts(writer, peer) &&
                  policies_between(writer, peer).empty();
         });
}

Happening ParticipantCore::incompatible(const Endpoint& endpoint, Found& found) const {
  Happening happening{Happening::Kind::incompatible_qos,
                      endpoint.topic,
                      endpoint.type,
                      to_hex(found.endpoint.guid),
                      unmet_policies(endpoint, found.endpoint),
                      0};
  happening.node = graph_.node_of(found.endpoint.guid);
  happening.ours_reads = !endpoint.writer;
  happening.theirs = found.endpoint.qos;
  happening.ours = endpoint.qos;
  found.needs_name = happening.node.empty();
  return happening;
}

std::vector<Happening> ParticipantCore::newly_incompatible(const Endpoint& endpoint,
                                                           const std::string& policies) {
  std::vector<Happening> events;
  const std::lock_guard lock{mutex_};
  bool is_of_others = found_.size() >= max_found;
  for (auto& [guid, found] : found_) {
    if (!are_counterparts(endpoint, found.endpoint)) {
      continue;
    }
    if (policies_between(endpoint, found.endpoint).empty()) {
      is_of_others = true;
    } else if (std::ranges::find(found.told, &endpoint) == found.told.end()) {
      found.told.push_back(&endpoint);
      events.push_back(incompatible(endpoint, found));
    }
  }
  // Here the policy is one that ROS 2 does not use, or the peer one that we had no room to remember. If no
  // peer is known at all, Fast DDS has not reported it yet, and will call again when it has.
  if (events.empty() && is_of_others) {
    events.push_back({Happening::Kind::incompatible_qos,
                      endpoint.topic,
                      endpoint.type,
                      "",
                      policies,
                      0,
                      "",
                      !endpoint.writer,
                      {}});
  }
  return events;
}

void ParticipantCore::report_incompatible(const Endpoint& endpoint, const fast::QosPolicyCountSeq& now,
                                          std::mutex& guard, fast::QosPolicyCountSeq& seen,
                                          std::uint64_t& count) {
  std::string policies;
  {
    const std::lock_guard lock{guard};
    policies = risen_policies(now, seen);
  }
  const std::vector<Happening> events = newly_incompatible(endpoint, policies);
  {
    const std::lock_guard lock{guard};
    count += events.size();
  }
  report(events);
}

void ParticipantCore::on_names() {
  std::vector<Happening> events;
  {
    const std::lock_guard lock{mutex_};
    for (auto& [guid, found] : found_) {
      if (found.needs_name && !graph_.node_of(guid).empty()) {
        for (const Endpoint* ours : found.told) {
          events.push_back(incompatible(*ours, found));
        }
      }
      if (found.other_hash && found.other_hash->node.empty()) {
        found.other_hash->node = graph_.node_of(guid);
        if (!found.other_hash->node.empty()) {
          events.push_back(*found.other_hash);
        }
      }
    }
  }
  report(events);
}

void ParticipantCore::silence() {
  const std::lock_guard lock{event_gate_};
  on_event_ = nullptr;
  on_writers_ = nullptr;
}

void ParticipantCore::on_peer(const fast::FoundPeer& peer) {
  using Change = fast::FoundPeer::Change;
  if (peer.change == Change::other) {
    const std::lock_guard lock{mutex_};
    if (const auto known = peers_.find(peer.guid.guidPrefix); known != peers_.end()) {
      known->second.addresses = peer.addresses;
    }
    return;
  }
  if (peer.change == Change::lost) {
    graph_.forget(peer.guid);
  }
  {
    const std::lock_guard lock{mutex_};
    if (peer.change == Change::lost) {
      peers_.erase(peer.guid.guidPrefix);
    } else if (peers_.size() < max_found) {
      peers_.insert_or_assign(peer.guid.guidPrefix, Peer{peer.vendor, peer.name, peer.addresses});
    }
  }
  const auto kind = peer.change == Change::found ? Happening::Kind::peer_found : Happening::Kind::peer_lost;
  report({kind, "", "", to_hex(peer.guid.guidPrefix), peer.name, 0});
}

void ParticipantCore::on_endpoint(const fast::FoundEndpoint& endpoint) {
  // Before it is matched, which Fast DDS does after this: no sample comes of one that is not known yet.
  if (!is_own(endpoint.guid)) {
    bridge_ends_.note(endpoint);
  }
  report(remember(endpoint));
  if (endpoint.writer && !is_own(endpoint.guid)) {
    const std::lock_guard lock{event_gate_};
    if (on_writers_) {
      on_writers_();
    }
  }
}

std::vector<Happening> ParticipantCore::remember(const fast::FoundEndpoint& endpoint) {
  const std::lock_guard lock{mutex_};
  if (!endpoint.there) {
    found_.erase(endpoint.guid);
    return {};
  }
  std::vector<Happening> events;
  auto known = found_.find(endpoint.guid);
  if (known != found_.end()) {
    known->second.endpoint = endpoint;  // announced again: what was reported is not reported again
  } else if (found_.size() < max_found) {
    known = found_.emplace(endpoint.guid, Found{endpoint, {}}).first;
  } else {
    ++not_remembered_;
  }
  if (known != found_.end()) {
    for (const Endpoint* own : endpoints_) {
      note_unserved(*own, known->second, events);
      note_hash(*own, known->second, events);
    }
  }
  const auto ours = std::ranges::find_if(endpoints_, [&](const Endpoint* own) {
    return own->topic == endpoint.topic && own->type != endpoint.type && own->writer != endpoint.writer;
  });
  if (ours != endpoints_.end()) {
    events.push_back({Happening::Kind::incompatible_type, endpoint.topic, (*ours)->type,
                      to_hex(endpoint.guid), endpoint.type, 0});
  }
  return events;
}

std::vector<FoundWriter> ParticipantCore::writers() const {
  const std::lock_guard lock{mutex_};
  std::vector<FoundWriter> result;
  for (const auto& [guid, found] : found_) {
    if (found.endpoint.writer && !is_own(guid)) {
      const auto bridge = bridge_ends_.text_of(guid);
      result.push_back({found.endpoint.topic, found.endpoint.type, found.endpoint.qos, bridge.has_value(),
                        bridge.value_or(std::string{}), !found.refused_by.empty(), graph_.node_of(guid)});
      Qos& qos = result.back().qos;
      qos.transient_local =
          qos.transient_local && user_data_value(found.endpoint.user_data, "durability") != "volatile";
    }
  }
  return result;
}

std::vector<Counterpart> ParticipantCore::counterparts(std::string_view topic, bool writers) const {
  std::vector<Counterpart> result;
  const std::lock_guard lock{mutex_};
  std::vector<const Endpoint*> ours;
  std::ranges::copy_if(endpoints_, std::back_inserter(ours),
                       [&](const Endpoint* one) { return one->topic == topic && one->writer != writers; });
  if (ours.empty()) {
    return result;
  }
  for (const auto& [guid, found] : found_) {
    const fast::FoundEndpoint& peer = found.endpoint;
    const bool matches =
        !is_own(guid) && found.refused_by.empty() && std::ranges::any_of(ours, [&](const Endpoint* one) {
          return are_counterparts(*one, peer) && policies_between(*one, peer).empty();
        });
    if (!matches || bridge_ends_.contains(guid)) {
      continue;
    }
    result.push_back({.guid = to_guid(guid), .node = graph_.node_of(guid)});
    if (const auto known = peers_.find(guid.guidPrefix); known != peers_.end()) {
      result.back().participant = known->second.name;
      result.back().addresses = known->second.addresses;
    }
  }
  return result;
}

std::vector<FoundParticipant> ParticipantCore::participants() const {
  const std::lock_guard lock{mutex_};
  std::vector<FoundParticipant> result;
  for (const auto& [prefix, peer] : peers_) {
    result.push_back({to_hex(prefix), peer.name, peer.addresses});
  }
  return result;
}

std::size_t ParticipantCore::peers() const {
  const std::lock_guard lock{mutex_};
  return peers_.size();
}

std::uint64_t ParticipantCore::not_remembered() const {
  const std::lock_guard lock{mutex_};
  return not_remembered_;
}

}  // namespace trestle::dds::detail
