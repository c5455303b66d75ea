#include "dds_adapter/participant_core.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>

#include "dds_adapter/link.hpp"
#include "dds_adapter/raw_type.hpp"

namespace trestle::dds::detail {

namespace {

constexpr std::uint32_t max_domain = 232;  // the highest whose ports, from 7400 + 250 * domain, fit 16 bits
// Asked for; the kernel gives at most net.core.rmem_max and wmem_max. A 4 MB sample is 64 datagrams at once.
constexpr std::uint32_t socket_buffer_bytes = 16U << 20U;
// A segment must hold several of the largest samples or it becomes the bottleneck.
constexpr std::uint32_t shared_memory_bytes = 128U << 20U;
constexpr std::uint32_t shared_message_bytes = 16U << 20U;

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

/// All IPv4 addresses of this host, as text.
std::vector<std::string> host_addresses() {
  std::vector<std::string> result;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) {
    return result;
  }
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr != nullptr && entry->ifa_addr->sa_family == AF_INET) {
      const void* address = entry->ifa_addr;
      std::array<char, INET_ADDRSTRLEN> text{};
      if (inet_ntop(AF_INET, &static_cast<const sockaddr_in*>(address)->sin_addr, text.data(), text.size()) !=
          nullptr) {
        result.emplace_back(text.data());
      }
    }
  }
  freeifaddrs(list);
  return result;
}

std::string not_ours(const std::string& address, const std::vector<std::string>& own) {
  std::string text =
      "no interface of this host has the address " + address + ", which DDS is to use; there are:";
  for (const std::string& one : own) {
    text.append(" ").append(one);
  }
  return text;
}

void check_interfaces(const std::vector<std::string>& interfaces) {
  if (interfaces.empty()) {
    return;
  }
  const std::vector<std::string> own = host_addresses();
  for (const std::string& address : interfaces) {
    in_addr parsed{};
    if (inet_pton(AF_INET, address.c_str(), &parsed) != 1) {
      throw DdsError{"DDS interface '" + address + "' is not an IPv4 address"};
    }
    if (std::ranges::find(own, address) == own.end()) {
      throw DdsError{not_ours(address, own)};
    }
  }
}

fast::DomainParticipantQos participant_qos(const ParticipantConfig& config) {
  fast::DomainParticipantQos qos;
  qos.name(config.name);
  auto& transport = qos.transport();
  transport.use_builtin_transports = false;
  const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = config.interfaces;
  udp->sendBufferSize = socket_buffer_bytes;
  udp->receiveBufferSize = socket_buffer_bytes;
  transport.user_transports.push_back(udp);
  if (config.shared_memory) {
    const auto shared = std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>();
    shared->segment_size(shared_memory_bytes);
    shared->max_message_size(shared_message_bytes);
    transport.user_transports.push_back(shared);
  }
  return qos;
}

}  // namespace

std::string to_hex(const decltype(fast::Guid::guidPrefix)& prefix) {
  return hex_digits(prefix.value, 12);
}

std::string to_hex(const fast::Guid& guid) {
  return to_hex(guid.guidPrefix) + hex_digits(guid.entityId.value, 4);
}

void check_endpoint(std::string_view what, std::string_view topic, std::string_view type, const Qos& qos) {
  constexpr std::size_t max_name = 255;       // of the strings in discovery
  constexpr std::uint32_t max_depth = 65536;  // well inside what Fast DDS can count
  const std::string subject = "DDS " + std::string{what} + " of topic '" + std::string{topic} + "': ";
  if (topic.empty() || topic.size() > max_name) {
    throw DdsError{subject + "a topic name has 1 to 255 characters"};
  }
  if (type.empty() || type.size() > max_name) {
    throw DdsError{subject + "the type name '" + std::string{type} + "' has not 1 to 255 characters"};
  }
  if (qos.depth < 1 || qos.depth > max_depth) {
    throw DdsError{subject + "history depth " + std::to_string(qos.depth) + " is out of range: 1 to " +
                   std::to_string(max_depth)};
  }
}

std::string risen_policies(const fast::QosPolicyCountSeq& now, fast::QosPolicyCountSeq& seen) {
  static constexpr std::array<const char*, 26> names{
      "",
      "user data",
      "durability",
      "presentation",
      "deadline",
      "latency budget",
      "ownership",
      "ownership strength",
      "liveliness",
      "time-based filter",
      "partition",
      "reliability",
      "destination order",
      "history",
      "resource limits",
      "entity factory",
      "writer data lifecycle",
      "reader data lifecycle",
      "topic data",
      "group data",
      "transport priority",
      "lifespan",
      "durability service",
      "data representation",
      "type consistency",
      "positive acknowledgements",
  };
  seen.resize(now.size());
  std::string result;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i].count > seen[i].count) {
      result += result.empty() ? "" : ", ";
      result += i < names.size() ? names[i] : "policy " + std::to_string(i);
    }
    seen[i] = now[i];
  }
  return result;
}

ParticipantCore::ParticipantCore(const ParticipantConfig& config) : on_event_{config.on_event} {
  link_type_object_guard();
  link_sanitizer_hints();
  if (config.domain > max_domain) {
    throw DdsError{"DDS domain " + std::to_string(config.domain) + " is out of range: 0 to " +
                   std::to_string(max_domain)};
  }
  check_interfaces(config.interfaces);
  const fast::DomainParticipantQos qos = participant_qos(config);
  // The callbacks of discovery come whatever the mask says, and from now on.
  auto* factory = fast::DomainParticipantFactory::get_instance();
  participant_ = factory->create_participant(config.domain, qos, this, fast::StatusMask::none());
  if (participant_ == nullptr) {
    throw DdsError{"Fast DDS could not make a participant in domain " + std::to_string(config.domain) +
                   "; its own message stands on standard error (are all ports of the domain taken?)"};
  }
  prefix_ = participant_->guid().guidPrefix;
  publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    destroy();
    throw DdsError{"Fast DDS could not make a publisher and a subscriber"};
  }
}

ParticipantCore::~ParticipantCore() {
  destroy();
}

void ParticipantCore::destroy() noexcept {
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

fast::Topic* ParticipantCore::use_topic(const std::string& topic, const std::string& type) {
  // Creating topics and types calls nobody back, so the lock may be held.
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

void ParticipantCore::add(const Endpoint* endpoint) {
  std::vector<Event> events;
  {
    const std::lock_guard lock{mutex_};
    endpoints_.push_back(endpoint);
    for (const auto& [guid, found] : found_) {
      if (found.topic == endpoint->topic && found.type != endpoint->type &&
          found.writer != endpoint->writer) {
        events.push_back(
            {Event::Kind::incompatible_type, endpoint->topic, endpoint->type, to_hex(guid), found.type, 0});
      }
    }
  }
  for (const Event& event : events) {
    report(event);
  }
}

void ParticipantCore::remove(const Endpoint* endpoint) noexcept {
  const std::lock_guard lock{mutex_};
  std::erase(endpoints_, endpoint);
}

std::size_t ParticipantCore::own_matches(const Endpoint& endpoint) const {
  const std::lock_guard lock{mutex_};
  return static_cast<std::size_t>(std::ranges::count_if(endpoints_, [&](const Endpoint* other) {
    if (other->topic != endpoint.topic || other->writer == endpoint.writer) {
      return false;
    }
    const Qos& offered = endpoint.writer ? endpoint.qos : other->qos;
    const Qos& wanted = endpoint.writer ? other->qos : endpoint.qos;
    return (offered.reliable || !wanted.reliable) && (offered.transient_local || !wanted.transient_local);
  }));
}

std::size_t ParticipantCore::foreign(std::int32_t count, const Endpoint& endpoint) const {
  const std::size_t own = own_matches(endpoint);
  const auto all = static_cast<std::size_t>(std::max(count, 0));
  return all > own ? all - own : 0;
}

void ParticipantCore::report(const Event& event) {
  const std::lock_guard lock{event_gate_};
  if (on_event_) {
    on_event_(event);
  }
}

void ParticipantCore::silence() {
  const std::lock_guard lock{event_gate_};
  on_event_ = nullptr;
}

void ParticipantCore::on_peer(const fast::FoundPeer& peer) {
  using Change = fast::FoundPeer::Change;
  if (peer.change == Change::other) {
    return;
  }
  const auto kind = peer.change == Change::found ? Event::Kind::peer_found : Event::Kind::peer_lost;
  report({kind, "", "", to_hex(peer.guid.guidPrefix), peer.name, 0});
}

void ParticipantCore::on_endpoint(const fast::FoundEndpoint& endpoint) {
  std::string expected;
  {
    const std::lock_guard lock{mutex_};
    if (!endpoint.there) {
      found_.erase(endpoint.guid);
      return;
    }
    if (found_.size() < max_found) {
      found_.insert_or_assign(endpoint.guid, endpoint);
    }
    const auto ours = std::ranges::find_if(endpoints_, [&](const Endpoint* own) {
      return own->topic == endpoint.topic && own->type != endpoint.type && own->writer != endpoint.writer;
    });
    if (ours == endpoints_.end()) {
      return;
    }
    expected = (*ours)->type;
  }
  report({Event::Kind::incompatible_type, endpoint.topic, expected, to_hex(endpoint.guid), endpoint.type, 0});
}

}  // namespace trestle::dds::detail

namespace trestle::dds {

const char* to_string(Event::Kind kind) noexcept {
  switch (kind) {
    case Event::Kind::peer_found:
      return "peer_found";
    case Event::Kind::peer_lost:
      return "peer_lost";
    case Event::Kind::matched:
      return "matched";
    case Event::Kind::unmatched:
      return "unmatched";
    case Event::Kind::incompatible_qos:
      return "incompatible_qos";
    case Event::Kind::incompatible_type:
      return "incompatible_type";
  }
  return "?";
}

Participant::Participant(const ParticipantConfig& config)
    : core_{std::make_shared<detail::ParticipantCore>(config)} {}
Participant::Participant(Participant&&) noexcept = default;

Participant& Participant::operator=(Participant&& other) noexcept {
  if (this != &other) {
    if (core_) {
      core_->silence();
    }
    core_ = std::move(other.core_);
  }
  return *this;
}

Participant::~Participant() {
  if (core_) {
    core_->silence();
  }
}

std::string Participant::guid() const {
  return core_->guid();
}

}  // namespace trestle::dds
