#pragma once
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bridge/messages/types/type_library.hpp"
#include "bridge/record/recorder.hpp"
#include "dds_adapter/participant.hpp"

namespace trestle::carry {

/// Records the ROS topics of a DDS domain: each that somebody writes to, from when it is discovered, as the
/// samples come. A reader asks for no more than all writers of its topic offer.
class TopicRecorder {
 public:
  struct Settings {
    dds::ParticipantConfig participant{};  ///< without on_writers
    std::vector<std::string> patterns{};   ///< of topics: topic_pattern.hpp
    messages::TypePlaces types{};
    std::function<void(const std::string& line)> note{};  ///< what begins, and what is missing
  };

  /// @param io        runs what is done when topics come. Outlives this, as the recorder does.
  /// @throws dds::DdsError
  TopicRecorder(boost::asio::io_context& io, Settings settings, record::Recorder& recorder);
  TopicRecorder(const TopicRecorder&) = delete;
  TopicRecorder& operator=(const TopicRecorder&) = delete;
  ~TopicRecorder();

  [[nodiscard]] std::size_t topics() const noexcept { return topics_.size(); }
  /// Samples that DDS did not deliver, of all topics.
  [[nodiscard]] dds::ReaderCounters counters() const;
  /// Nothing is recorded any more.
  void stop();

 private:
  struct Topic {
    std::uint16_t channel = 0;
    dds::Qos asked{};
    std::optional<dds::Reader> reader{};
    dds::ReaderCounters past{};
  };

  void look();
  void follow(const std::string& name, const std::string& type, const std::vector<dds::Qos>& writers);
  void open(const std::string& name, const std::string& type, Topic& topic);
  [[nodiscard]] record::ChannelInfo channel_of(const std::string& name, const std::string& type,
                                               const std::vector<dds::Qos>& writers);
  [[nodiscard]] bool is_wanted(const std::string& topic) const;
  void note_once(const std::string& line);

  struct Wake;
  std::shared_ptr<Wake> wake_;
  Settings settings_;
  record::Recorder& recorder_;
  messages::TypeLibrary library_;
  std::set<std::string> told_;
  std::map<std::string, Topic> topics_;  ///< by "name type"
  dds::Participant participant_;
};

}  // namespace trestle::carry
