#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "dds_adapter/fastdds_compat.hpp"
#include "dds_adapter/participant.hpp"
#include "dds_adapter/ros_graph_message.hpp"

namespace trestle::dds::detail {

/// DDS name and type of the topic that carries ROS 2's graph.
inline constexpr const char* graph_topic = "ros_discovery_info";
inline constexpr const char* graph_type = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

/// @throws DdsError  unless ROS 2 would accept the node's name: "/trestle", "/sensing/front/trestle".
void check_node_name(std::string_view node);

/// A participant's part in ROS 2's graph: tells which node our readers and writers belong to, and learns that
/// of others. Lives as long as its participant; quiet where ParticipantConfig::node is empty.
class RosGraph final : private fast::DataReaderListener {
 public:
  /// @param on_names  called on threads of DDS after a participant has told of its nodes.
  RosGraph(const ParticipantConfig& config, std::function<void()> on_names);
  RosGraph(const RosGraph&) = delete;
  RosGraph& operator=(const RosGraph&) = delete;
  ~RosGraph() override = default;

  [[nodiscard]] bool is_wanted() const noexcept { return !own_.nodes.empty(); }

  /// Begins to tell and to listen. The entities are deleted with all others of the participant.
  /// @throws DdsError
  void open(const fast::Guid& participant, fast::Publisher& publisher, fast::Subscriber& subscriber,
            fast::Topic& topic);
  /// After this nothing of this object is used by DDS.
  void close() noexcept;

  /// A reader or writer of ours has been made, or is about to go.
  void add(const fast::Guid& endpoint, bool writer);
  void remove(const fast::Guid& endpoint) noexcept;

  /// The node that a peer's reader or writer belongs to, "/rviz"; empty when that is not known (yet).
  [[nodiscard]] std::string node_of(const fast::Guid& endpoint) const;
  /// A peer has gone.
  void forget(const fast::Guid& participant);

 private:
  void on_data_available(fast::DataReader* reader) override;
  void learn(ByteView sample, const fast::Guid& from);
  void publish();

  struct Peer {
    std::vector<NodeEntities> nodes;
    std::size_t bytes = 0;  ///< of the sample that said so
  };
  /// Of all peers' last samples together: names of those that come when it is full stay unknown.
  static constexpr std::size_t max_names_bytes = std::size_t{4} << 20U;

  const std::function<void()> on_names_;
  mutable std::mutex names_mutex_;  ///< of the three below; nothing is called while it is held
  std::map<decltype(fast::Guid::guidPrefix), Peer> peers_;
  std::size_t names_bytes_ = 0;
  bool open_ = false;

  /// Held while the snapshot is written, so that the last one that is sent is the newest. DDS sends it from a
  /// thread of its own: nobody is called back meanwhile.
  std::mutex own_mutex_;
  ParticipantEntities own_;
  GidForm form_;
  const bool detects_form_;
  decltype(fast::Guid::guidPrefix) own_prefix_;
  fast::DataWriter* writer_ = nullptr;
  fast::DataReader* reader_ = nullptr;
};

}  // namespace trestle::dds::detail
