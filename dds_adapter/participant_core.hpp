#pragma once
#include <array>
#include <atomic>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "dds_adapter/bridge_ends.hpp"
#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/participant.hpp"
#include "dds_adapter/ros_graph.hpp"
#include "dds_adapter/sample_sockets.hpp"

namespace trestle::dds::detail {

/// GUID or GUID prefix as hexadecimal digits.
[[nodiscard]] std::string to_hex(const fast::Guid& guid);
[[nodiscard]] std::string to_hex(const fast::Prefix& prefix);

[[nodiscard]] Guid to_guid(const fast::Guid& guid) noexcept;
[[nodiscard]] fast::Guid to_fast(const Guid& guid) noexcept;

/// Everything that Fast DDS has to know of a participant, but its domain.
/// @param sockets  that are to receive by UDP; none: threads of DDS do.
/// @throws DdsError  for interfaces, profiles, servers and keys that cannot be used: says which.
[[nodiscard]] fast::DomainParticipantQos participant_qos(const ParticipantConfig& config,
                                                         const std::shared_ptr<SampleSockets>& sockets);

/// In the user data of a writer that announces itself as transient local but keeps nothing for late readers.
inline constexpr const char* forgets_entry = "durability=volatile;";

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
    Qos qos;  ///< as announced
    bool writer = false;
    std::string user_data{};
    bool bridge = false;         ///< the end of one ...
    TakesBridge takes_bridge{};  ///< ... and which others are none to it
    /// Of a volatile writer that announces itself as transient local: counts the readers that match it and
    /// will miss what was written before they came. DDS does not tell of these.
    std::atomic<std::uint64_t>* unserved = nullptr;
    /// Of a writer: counts the readers that get nothing for the hash of their type.
    std::atomic<std::uint64_t>* refused = nullptr;
    /// How many of our own endpoints match this one, which are no counterparts: asked for before each sample.
    std::unique_ptr<std::atomic<std::size_t>> own_matches = std::make_unique<std::atomic<std::size_t>>(0);
    /// Those that ParticipantCore::ignores().
    std::unique_ptr<IgnoredMatches> ignored_matches = std::make_unique<IgnoredMatches>();

    /// How many of `count` matched endpoints are counterparts: not our own, and not ignored.
    [[nodiscard]] std::size_t foreign(std::int32_t count) const noexcept;
  };

  /// The topic, with its type registered; made on its first use and deleted with its last.
  fast::Topic* use_topic(const std::string& topic, const std::string& type);
  /// To be called before it is made, which tells of its matches.
  void count_own_matches(const Endpoint& endpoint) const;
  void drop_topic(const std::string& topic) noexcept;

  /// To be called when it has been made; tells ROS 2 of it, and reports foreign endpoints of its topic that
  /// have another type or miss what it does not keep.
  void add(const Endpoint* endpoint, const fast::Guid& guid);
  void remove(const Endpoint* endpoint, const fast::Guid& guid) noexcept;

  void report(const Happening& happening);
  void report(const std::vector<Happening>& events);
  void report(Happening::Kind kind, const Endpoint& endpoint, const std::string& peer = {},
              std::size_t matched = 0);
  /// A peer matches this endpoint, or does not any more: counts and reports it.
  /// @return whether it is a counterpart.
  bool note_match(const Endpoint& endpoint, const fast::Guid& peer, const fast::MatchedStatus& status,
                  std::atomic<std::int32_t>& matched);
  /// Whether a reliable reader matches this writer. One that there was no room to remember may be one.
  [[nodiscard]] bool has_reliable_reader(const Endpoint& writer) const;

  /// Some peer does not match this endpoint: reports and counts each new one, named as far as it is known.
  /// @param now    how often each policy was in the way, by Fast DDS.
  /// @param guard  of `seen`, the last `now`, and of `count`; not held during the reports.
  void report_incompatible(const Endpoint& endpoint, const fast::QosPolicyCountSeq& now, std::mutex& guard,
                           fast::QosPolicyCountSeq& seen, std::uint64_t& count);
  /// No more events after this.
  void silence();

  [[nodiscard]] const FoundBridgeEnds& bridge_ends() const noexcept { return bridge_ends_; }
  [[nodiscard]] std::vector<FoundWriter> writers() const;
  [[nodiscard]] std::vector<FoundParticipant> participants() const;
  [[nodiscard]] std::vector<Counterpart> counterparts(std::string_view topic, bool writers) const;
  [[nodiscard]] std::size_t peers() const;
  [[nodiscard]] std::uint64_t not_remembered() const;

  [[nodiscard]] bool strict_types() const noexcept { return strict_types_; }
  [[nodiscard]] bool frees_samples() const noexcept { return frees_samples_; }
  /// Whether the peer is refused for the hash of its type.
  [[nodiscard]] bool refuses(const Endpoint& ours, const fast::Guid& peer) const;
  /// Whether this endpoint ignores one that it matches: that one is refused, or both are ends of bridges.
  [[nodiscard]] bool ignores(const Endpoint& ours, const fast::Guid& peer) const;

  [[nodiscard]] bool is_own(const fast::Guid& guid) const noexcept { return guid.guidPrefix == prefix_; }
  [[nodiscard]] std::string guid() const { return to_hex(prefix_); }
  [[nodiscard]] bool shares_memory() const;
  [[nodiscard]] std::vector<std::string> buffers_not_granted() const;
  /// To be called for each sample that is written, without a lock.
  void note_size(std::size_t bytes) {
    if (bytes > large_sample_.load(std::memory_order_relaxed)) {
      on_large_sample();
    }
  }
  [[nodiscard]] SampleSockets* sockets() const noexcept { return sockets_.get(); }
  [[nodiscard]] Vendor vendor(const fast::Prefix& participant) const;
  [[nodiscard]] fast::Publisher* publisher() const noexcept { return publisher_; }
  [[nodiscard]] fast::Subscriber* subscriber() const noexcept { return subscriber_; }

 private:
  // May come before the constructor has finished. Fast DDS also tells of our own endpoints.
  void on_peer(const fast::FoundPeer& peer) override;
  void on_endpoint(const fast::FoundEndpoint& endpoint) override;
  struct Found {
    fast::FoundEndpoint endpoint;
    std::vector<const Endpoint*> told;          ///< ours that it does not match, which has been reported
    bool needs_name = false;                    ///< ... but not yet of which node
    std::optional<Happening> other_hash{};      ///< that its type is not ours, which has been reported
    std::vector<const Endpoint*> refused_by{};  ///< ours that have counted it
  };

  /// What discovery tells, and what is to be reported of it.
  [[nodiscard]] std::vector<Happening> remember(const fast::FoundEndpoint& endpoint);
  /// Adds what a writer of ours that announces too much is to report of this reader.
  void note_unserved(const Endpoint& endpoint, Found& found, std::vector<Happening>& events) const;
  /// Adds what is to report of a counterpart whose type is another one of the same name.
  void note_hash(const Endpoint& endpoint, Found& found, std::vector<Happening>& events);
  void on_large_sample();
  [[nodiscard]] std::uint32_t send_buffer_wanted() const;
  void destroy() noexcept;
  /// A peer has told of its nodes: those that were reported without one are reported again.
  void on_names();
  [[nodiscard]] std::vector<Happening> newly_incompatible(const Endpoint& endpoint,
                                                          const std::string& policies);
  Happening incompatible(const Endpoint& endpoint, Found& found) const;

  struct UsedTopic {
    fast::Topic* topic = nullptr;
    std::string type;
    std::size_t users = 0;
  };

  const std::shared_ptr<SampleSockets> sockets_;  ///< of one that is polled
  RosGraph graph_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::Publisher* publisher_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
  fast::Prefix prefix_;

  FoundBridgeEnds bridge_ends_;  ///< of others
  mutable std::mutex mutex_;
  static constexpr std::size_t max_found = 4096;
  std::map<std::string, UsedTopic> topics_;
  std::vector<const Endpoint*> endpoints_;
  /// Readers and writers, also ours: for questions, and to report another type on a topic that we use later.
  std::map<fast::Guid, Found> found_;
  const bool strict_types_;
  const bool frees_samples_;
  static constexpr std::size_t never_large = std::numeric_limits<std::size_t>::max();
  std::atomic<std::size_t> large_sample_ = never_large;  ///< to be told of when a larger one is written
  std::uint64_t not_remembered_ = 0;                     ///< as there was no room
  struct Peer {
    std::array<std::uint8_t, 2> vendor{};
    std::string name{};
    std::vector<std::string> addresses{};
  };
  std::map<fast::Prefix, Peer> peers_;  ///< foreign participants

  std::mutex event_gate_;
  std::function<void(const Happening&)> on_event_;
  std::function<void()> on_writers_;
};

}  // namespace trestle::dds::detail
