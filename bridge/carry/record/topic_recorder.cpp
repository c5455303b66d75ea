#include "bridge/carry/record/topic_recorder.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <chrono>

#include "bridge/carry/config/topic_pattern.hpp"
#include "bridge/messages/types/type_hash.hpp"
#include "bridge/record/offered_qos.hpp"
#include "bridge/record/ros2msg.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::carry {
namespace {

/// Samples are taken as they come; more than these would wait in the reader only while the recorder holds its
/// lock.
constexpr std::uint32_t depth = 100;

record::LogTime now() {
  return static_cast<record::LogTime>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                          std::chrono::system_clock::now().time_since_epoch())
                                          .count());
}

/// Names in the words of people: "reliable, transient local".
std::string words_of(const dds::Qos& qos) {
  return fmt::format("{}{}", qos.reliable ? "reliable" : "best effort",
                     qos.transient_local ? ", transient local" : "");
}

}  // namespace

/// From the threads of DDS to that of the io_context; outlives the recorder as long as DDS may call.
struct TopicRecorder::Wake {
  Wake(boost::asio::io_context& context, TopicRecorder* whom) : io{context}, recorder{whom} {}

  static void up(const std::shared_ptr<Wake>& wake) {
    if (!wake->is_due.exchange(true)) {
      boost::asio::post(wake->io, [wake] {
        wake->is_due = false;
        if (wake->recorder != nullptr) {
          wake->recorder->look();
        }
      });
    }
  }

  boost::asio::io_context& io;
  TopicRecorder* recorder;  ///< used on the io_context's thread alone
  std::atomic<bool> is_due = false;
};

TopicRecorder::TopicRecorder(boost::asio::io_context& io, Settings settings, record::Recorder& recorder)
    : wake_{std::make_shared<Wake>(io, this)},
      settings_{std::move(settings)},
      recorder_{recorder},
      library_{messages::TypeLibrary::in(settings_.types)},
      participant_{[this] {
        dds::ParticipantConfig config = settings_.participant;
        config.on_writers = [wake = wake_] { Wake::up(wake); };
        return dds::Participant{config};
      }()} {
  Wake::up(wake_);  // what was found before there was anybody to tell
}

TopicRecorder::~TopicRecorder() {
  stop();
}

void TopicRecorder::stop() {
  wake_->recorder = nullptr;
  for (auto& [name, topic] : topics_) {
    if (topic.reader) {
      topic.past += topic.reader->counters();
      topic.reader.reset();
    }
  }
}

bool TopicRecorder::is_wanted(const std::string& topic) const {
  return std::ranges::any_of(settings_.patterns,
                             [&](const std::string& pattern) { return matches(pattern, topic); });
}

void TopicRecorder::look() {
  std::map<std::pair<std::string, std::string>, std::vector<dds::Qos>> found;
  for (const dds::FoundWriter& writer : participant_.writers()) {
    const auto topic = dds::topic_of_ros(writer.topic);
    const auto type = dds::type_of_ros(writer.type);
    if (topic && type && is_wanted(*topic)) {
      found[{*topic, *type}].push_back(writer.qos);
    }
  }
  for (const auto& [name, writers] : found) {
    follow(name.first, name.second, writers);
  }
}

void TopicRecorder::follow(const std::string& name, const std::string& type,
                           const std::vector<dds::Qos>& writers) {
  dds::Qos least = record::least_of(writers);
  least.depth = depth;
  const auto [at, is_new] = topics_.try_emplace(fmt::format("{} {}", name, type));
  Topic& topic = at->second;
  try {
    if (is_new) {
      const auto channel = recorder_.add_channel(channel_of(name, type, writers));
      if (!channel) {
        note_once(fmt::format("{}: not recorded: there are more topics than a file can have", name));
        return;
      }
      topic.channel = *channel;
      topic.asked = least;
      open(name, type, topic);
      settings_.note(fmt::format("recording {} ({}), {}", name, type, words_of(least)));
    } else if (topic.reader && topic.asked.reliable && !least.reliable) {
      // Without that the new writer's samples would not come. Nothing comes twice: what is best effort is
      // never told again.
      topic.past += topic.reader->counters();
      topic.reader.reset();
      topic.asked = least;
      open(name, type, topic);
    }
  } catch (const dds::DdsError& error) {
    note_once(fmt::format("{}: not recorded: {}", name, error.what()));
  }
}

void TopicRecorder::open(const std::string& name, const std::string& type, Topic& topic) {
  topic.reader.emplace(participant_.create_reader(
      dds::ros_topic_name(name), dds::ros_type_name(type), topic.asked,
      [&recorder = recorder_, channel = topic.channel](dds::Sample sample) {
        const record::LogTime came = now();
        const auto sent = static_cast<record::LogTime>(sample.source_time().count());
        const auto number = static_cast<std::uint32_t>(sample.sequence());
        recorder.add(channel, came, sent == 0 ? came : sent, number, std::move(sample));
      }));
}

record::ChannelInfo TopicRecorder::channel_of(const std::string& name, const std::string& type,
                                              const std::vector<dds::Qos>& writers) {
  record::ChannelInfo info{.topic = name, .type = type, .encoding = "cdr"};
  info.metadata["offered_qos_profiles"] = record::offered_qos(writers);
  if (const auto tree = library_.resolve(type)) {
    info.schema_encoding = record::ros2msg_encoding;
    info.schema = record::ros2msg(*tree);
  } else {
    note_once(fmt::format("{}: recorded without its definition: {}", name, to_string(tree.error())));
  }
  if (const auto hash = messages::type_hash(library_, type)) {
    info.metadata["topic_type_hash"] = *hash;
  }
  return info;
}

void TopicRecorder::note_once(const std::string& line) {
  if (told_.insert(line).second) {
    settings_.note(line);
  }
}

dds::ReaderCounters TopicRecorder::counters() const {
  dds::ReaderCounters sum;
  for (const auto& [name, topic] : topics_) {
    sum += topic.past;
    if (topic.reader) {
      sum += topic.reader->counters();
    }
  }
  return sum;
}

}  // namespace trestle::carry
