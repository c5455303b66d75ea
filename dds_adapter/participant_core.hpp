#pragma once
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::dds::detail {

/// GUID or GUID prefix as hexadecimal digits.
[[nodiscard]] std::string to_hex(const fast::Guid& guid);
[[nodiscard]] std::string to_hex(const decltype(fast::Guid::guidPrefix)& prefix);

/// @throws DdsError  unless the names are usable and the quality of service makes sense.
void check_endpoint(std::string_view what, std::string_view topic, std::string_view type, const Qos& qos);

/// The policies whose count has risen since `seen`, by name; brings `seen` up to date.
[[nodiscard]] std::string risen_policies(const fast::QosPolicyCountSeq& now, fast::QosPolicyCountSeq& seen);

/// The DDS entities that all readers and writers share. Each of them, and each sample on loan, keeps it.
///
/// Locks: `mutex_` guards the tables below and is never held while DDS is called in a way that can call back.
/// `event_gate_` is held while the handler runs, so that closing waits for it.
class ParticipantCore final : private fast::DiscoveryListener {
 public:
  explicit ParticipantCore(const ParticipantConfig& config);
  ~ParticipantCore() override;
  ParticipantCore(const ParticipantCore&) = delete;
  ParticipantCore& operator=(const ParticipantCore&) = delete;

  /// A reader or writer of ours.
  struct Endpoint {
    std::string topic;
    std::string type;
    Qos qos;
    bool writer = false;
  };

  /// The topic, with its type registered; made on its first use and deleted with its last.
  fast::Topic* use_topic(const std::string& topic, const std::string& type);
  void drop_topic(const std::string& topic) noexcept;

  /// To be called when it has been made; reports foreign endpoints of its topic that have another type.
  void add(const Endpoint* endpoint);
  void remove(const Endpoint* endpoint) noexcept;
  /// How many of our own endpoints match this one: they are no counterparts.
  [[nodiscard]] std::size_t own_matches(const Endpoint& endpoint) const;
  /// How many of `count` matched endpoints are not our own.
  [[nodiscard]] std::size_t foreign(std::int32_t count, const Endpoint& endpoint) const;

  void report(const Event& event);
  /// No more events after this.
  void silence();

  [[nodiscard]] bool is_own(const fast::Guid& guid) const noexcept { return guid.guidPrefix == prefix_; }
  [[nodiscard]] std::string guid() const { return to_hex(prefix_); }
  [[nodiscard]] fast::Publisher* publisher() const noexcept { return publisher_; }
  [[nodiscard]] fast::Subscriber* subscriber() const noexcept { return subscriber_; }

 private:
  // Only of others; may come before the constructor has finished.
  void on_peer(const fast::FoundPeer& peer) override;
  void on_endpoint(const fast::FoundEndpoint& endpoint) override;
  void destroy() noexcept;

  struct UsedTopic {
    fast::Topic* topic = nullptr;
    std::string type;
    std::size_t users = 0;
  };

  fast::DomainParticipant* participant_ = nullptr;
  fast::Publisher* publisher_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
  decltype(fast::Guid::guidPrefix) prefix_;

  mutable std::mutex mutex_;
  static constexpr std::size_t max_found = 4096;
  std::map<std::string, UsedTopic> topics_;
  std::vector<const Endpoint*> endpoints_;
  /// Foreign readers and writers, for telling of another type on a topic that we begin to use later.
  std::map<fast::Guid, fast::FoundEndpoint> found_;

  std::mutex event_gate_;
  std::function<void(const Event&)> on_event_;
};

}  // namespace trestle::dds::detail
