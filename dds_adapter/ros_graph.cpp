#include "dds_adapter/ros_graph.hpp"

#include <algorithm>

#include "dds_adapter/participant_core.hpp"
#include "dds_adapter/raw_type.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::dds::detail {

namespace {

/// The hash of graph_type by REP-2011, which is the same in all distributions that have one.
constexpr const char* graph_type_hash =
    "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e";

bool is_node_token(std::string_view token) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !token.empty() && is_letter(token.front()) &&
         std::ranges::all_of(token, [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

fast::DataWriterQos graph_writer_qos() {
  fast::DataWriterQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 1;
  qos.endpoint().history_memory_policy = fast::dynamic_reusable;
  qos.data_sharing().off();
  // The sending thread of Fast DDS 2.9 sends a last message without the writer's lock. When the last reader,
  // often our own, leaves meanwhile, a participant whose messages are protected ends in an assertion.
  qos.publish_mode().kind = fast::SYNCHRONOUS_PUBLISH_MODE;
  fast::set_user_data(qos, ros_type_hash_entry(graph_type_hash));
  return qos;
}

fast::DataReaderQos graph_reader_qos() {
  constexpr std::int32_t depth = 64;  // samples are taken as soon as they come
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  qos.resource_limits().max_samples = depth;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().max_samples_per_instance = depth;
  qos.resource_limits().allocated_samples = 1;
  qos.endpoint().history_memory_policy = fast::dynamic_reusable;
  qos.data_sharing().off();
  fast::set_user_data(qos, ros_type_hash_entry(graph_type_hash));
  return qos;
}

}  // namespace

void check_node_name(std::string_view node) {
  constexpr std::size_t characters_max = 255;
  bool good = node.starts_with('/') && node.size() <= characters_max;
  for (std::string_view rest = node; good && !rest.empty();) {
    rest.remove_prefix(1);  // the slash
    const std::size_t slash = std::min(rest.find('/'), rest.size());
    good = is_node_token(rest.substr(0, slash));
    rest.remove_prefix(slash);
  }
  if (!good) {
    throw DdsError{
        "'" + std::string{node} +
        "' is no name of a ROS 2 node: it is absolute, of letters, digits and '_', such as /trestle"};
  }
}

RosGraph::RosGraph(const ParticipantConfig& config, std::function<void()> on_names)
    : on_names_{std::move(on_names)},
      form_{config.gid_bytes == 24 ? GidForm::humble : GidForm::iron},
      detects_form_{config.gid_bytes == 0} {
  if (config.node.empty()) {
    return;
  }
  check_node_name(config.node);
  if (config.gid_bytes != 0 && config.gid_bytes != 16 && config.gid_bytes != 24) {
    throw DdsError{"ids in ROS 2's graph have 16 or 24 bytes, not " + std::to_string(config.gid_bytes)};
  }
  const std::size_t slash = config.node.rfind('/');
  own_.nodes.push_back(
      {slash == 0 ? "/" : config.node.substr(0, slash), config.node.substr(slash + 1), {}, {}});
}

void RosGraph::open(const fast::Guid& participant, fast::Publisher& publisher, fast::Subscriber& subscriber,
                    fast::Topic& topic) {
  own_.participant = to_guid(participant);
  own_prefix_ = participant.guidPrefix;
  {
    const std::lock_guard lock{names_mutex_};
    open_ = true;
  }
  {
    const std::lock_guard lock{own_mutex_};
    writer_ = publisher.create_datawriter(&topic, graph_writer_qos());
  }
  reader_ = subscriber.create_datareader(&topic, graph_reader_qos(), this);
  if (writer_ == nullptr || reader_ == nullptr) {
    throw DdsError{"Fast DDS could not make the reader and writer of " + std::string{graph_topic} +
                   ", by which ROS 2 nodes know each other"};
  }
  const std::lock_guard lock{own_mutex_};
  publish();
}

void RosGraph::close() noexcept {
  if (reader_ != nullptr) {
    reader_->set_listener(nullptr);
  }
  const std::lock_guard lock{names_mutex_};
  open_ = false;
}

void RosGraph::add(const fast::Guid& endpoint, bool writer) {
  if (!is_wanted()) {
    return;
  }
  const std::lock_guard lock{own_mutex_};
  (writer ? own_.nodes[0].writers : own_.nodes[0].readers).push_back(to_guid(endpoint));
  publish();
}

void RosGraph::remove(const fast::Guid& endpoint) noexcept {
  if (!is_wanted()) {
    return;
  }
  const std::lock_guard lock{own_mutex_};
  const Gid gid = to_guid(endpoint);
  std::erase(own_.nodes[0].readers, gid);
  std::erase(own_.nodes[0].writers, gid);
  publish();
}

void RosGraph::publish() {
  if (writer_ == nullptr) {
    return;
  }
  const std::vector<std::byte> sample = encode(own_, form_);
  const ByteView slice{sample};
  RawSample raw;
  raw.slices = {&slice, 1};
  raw.size = sample.size();
  writer_->write(&raw, fast::HANDLE_NIL);
}

std::string RosGraph::node_of(const fast::Guid& endpoint) const {
  const Gid gid = to_guid(endpoint);
  const std::lock_guard lock{names_mutex_};
  const auto peer = peers_.find(endpoint.guidPrefix);
  if (peer == peers_.end()) {
    return {};
  }
  for (const NodeEntities& node : peer->second.nodes) {
    if (std::ranges::find(node.readers, gid) != node.readers.end() ||
        std::ranges::find(node.writers, gid) != node.writers.end()) {
      return (node.name_space == "/" ? "" : node.name_space) + "/" + node.name;
    }
  }
  return {};
}

void RosGraph::forget(const fast::Guid& participant) {
  const std::lock_guard lock{names_mutex_};
  const auto peer = peers_.find(participant.guidPrefix);
  if (peer != peers_.end()) {
    names_bytes_ -= peer->second.bytes;
    peers_.erase(peer);
  }
}

void RosGraph::on_data_available(fast::DataReader* reader) {
  fast::LoanableSequence<RawSample> samples;
  fast::SampleInfoSeq infos;
  while (fast::is_ok(reader->take(samples, infos, 1))) {
    if (infos[0].valid_data) {
      learn(samples[0].received, infos[0].sample_identity.writer_guid());
    }
    reader->return_loan(samples, infos);
  }
}

void RosGraph::learn(ByteView sample, const fast::Guid& from) {
  auto decoded = decode_entities(sample);
  if (!decoded || from.guidPrefix == own_prefix_) {
    return;
  }
  {
    const std::lock_guard lock{names_mutex_};
    if (!open_) {
      return;
    }
    const auto known = peers_.find(from.guidPrefix);
    const std::size_t before = known == peers_.end() ? 0 : known->second.bytes;
    if (names_bytes_ - before + sample.size() <= max_names_bytes) {
      names_bytes_ += sample.size() - before;
      peers_.insert_or_assign(from.guidPrefix, Peer{std::move(decoded->entities.nodes), sample.size()});
    }
  }
  on_names_();
  // Humble's nodes cannot read the other form, and later nodes cannot read Humble's. Changed only once: two
  // bridges that always took the form they heard last would follow each other for ever.
  if (detects_form_ && decoded->form == GidForm::humble) {
    const std::lock_guard lock{own_mutex_};
    if (form_ != GidForm::humble) {
      form_ = GidForm::humble;
      publish();
    }
  }
}

}  // namespace trestle::dds::detail
