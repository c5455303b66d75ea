#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>

#include "bridge/carry/record/players.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::carry {
namespace {

using namespace std::chrono_literals;

/// How long readers that are stuck are waited for.
constexpr auto received_within = 2s;

class TopicPlayer final : public Player {
 public:
  TopicPlayer(const dds::ParticipantConfig& participant, const std::vector<const RecordedTopic*>& topics,
              const Remaps& remaps, const std::function<void(const std::string&)>& note)
      : participant_{participant} {
    for (const RecordedTopic* const topic : topics) {
      const auto mapped = std::ranges::find(remaps, topic->name, &Remaps::value_type::first);
      const std::string& name = mapped == remaps.end() ? topic->name : mapped->second;
      writers_.emplace(topic,
                       participant_.create_writer(
                           dds::ros_topic_name(name), dds::ros_type_name(topic->type), topic->qos,
                           dds::default_max_sample_bytes,
                           {.user_data = topic->hash.empty() ? "" : dds::ros_type_hash_entry(topic->hash)}));
      note(fmt::format("writing {} ({}), {}{}", name, topic->type,
                       topic->qos.reliable ? "reliable" : "best effort",
                       topic->qos.transient_local ? ", transient local" : ""));
    }
  }

  bool play(const Replayed& one) override {
    const auto writer = one.topic == nullptr ? writers_.end() : writers_.find(one.topic);
    if (writer == writers_.end()) {
      ++(one.topic == nullptr ? someip_ : not_wanted_);
      return false;
    }
    if (const auto written = writer->second.write(one.sample); !written) {
      ++refused_[to_string(written.error())];
      return false;
    }
    return true;
  }

  bool has_receivers() const override {
    return std::ranges::all_of(writers_, [](const auto& one) { return one.second.matched() > 0; });
  }

  std::vector<std::pair<std::string, std::uint64_t>> not_sent() const override {
    std::vector<std::pair<std::string, std::uint64_t>> all{
        {"messages of topics that were not asked for", not_wanted_},
        {"SOME/IP messages, which need --config or --to someip", someip_}};
    for (const auto& [why, count] : refused_) {
      all.emplace_back(fmt::format("samples that DDS refused ({})", why), count);
    }
    return all;
  }

  /// Not before reliable readers have all of it.
  void stop() override {
    const auto end = std::chrono::steady_clock::now() + received_within;
    for (const auto& [topic, writer] : writers_) {
      (void)writer.wait_until_received(
          std::max<std::chrono::nanoseconds>(end - std::chrono::steady_clock::now(), 0ns));
    }
  }

 private:
  dds::Participant participant_;
  std::map<const RecordedTopic*, dds::Writer> writers_;
  std::uint64_t not_wanted_ = 0;
  std::uint64_t someip_ = 0;
  std::map<std::string, std::uint64_t> refused_;
};

}  // namespace

std::unique_ptr<Player> play_to_topics(const dds::ParticipantConfig& participant,
                                       const std::vector<const RecordedTopic*>& topics, const Remaps& remaps,
                                       const std::function<void(const std::string&)>& note) {
  return std::make_unique<TopicPlayer>(participant, topics, remaps, note);
}

}  // namespace trestle::carry
