#include "bridge/record/bag_metadata.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

namespace trestle::record {
namespace {

constexpr int version = 5;

void put_times(YAML::Emitter& out, LogTime start, LogTime end) {
  out << YAML::Key << "duration" << YAML::Value << YAML::BeginMap << YAML::Key << "nanoseconds" << YAML::Value
      << end - start << YAML::EndMap;
  out << YAML::Key << "starting_time" << YAML::Value << YAML::BeginMap << YAML::Key
      << "nanoseconds_since_epoch" << YAML::Value << start << YAML::EndMap;
}

void put_topic(YAML::Emitter& out, const BagTopic& topic) {
  out << YAML::BeginMap << YAML::Key << "topic_metadata" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << topic.name;
  out << YAML::Key << "type" << YAML::Value << topic.type;
  out << YAML::Key << "serialization_format" << YAML::Value << "cdr";
  out << YAML::Key << "offered_qos_profiles" << YAML::Value << YAML::DoubleQuoted << topic.qos;
  out << YAML::EndMap << YAML::Key << "message_count" << YAML::Value << topic.messages << YAML::EndMap;
}

void put_file(YAML::Emitter& out, const BagFile& file) {
  out << YAML::BeginMap << YAML::Key << "path" << YAML::Value << file.name;
  put_times(out, file.start, file.end);
  out << YAML::Key << "message_count" << YAML::Value << file.messages << YAML::EndMap;
}

}  // namespace

std::string bag_metadata(const std::vector<BagTopic>& topics, const std::vector<BagFile>& files) {
  std::uint64_t messages = 0;
  LogTime start = 0;
  LogTime end = 0;
  for (const BagFile& file : files) {
    if (file.messages > 0) {
      start = messages == 0 ? file.start : std::min(start, file.start);
      end = std::max(end, file.end);
      messages += file.messages;
    }
  }
  std::uint64_t of_topics = 0;
  for (const BagTopic& topic : topics) {
    of_topics += topic.messages;
  }
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "rosbag2_bagfile_information" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "version" << YAML::Value << version;
  out << YAML::Key << "storage_identifier" << YAML::Value << "mcap";
  put_times(out, start, end);
  out << YAML::Key << "message_count" << YAML::Value << of_topics;
  out << YAML::Key << "topics_with_message_count" << YAML::Value << YAML::BeginSeq;
  for (const BagTopic& topic : topics) {
    put_topic(out, topic);
  }
  out << YAML::EndSeq;
  // Of the bag as a whole: chunks of a file are the business of the storage.
  out << YAML::Key << "compression_format" << YAML::Value << YAML::DoubleQuoted << "";
  out << YAML::Key << "compression_mode" << YAML::Value << YAML::DoubleQuoted << "";
  out << YAML::Key << "relative_file_paths" << YAML::Value << YAML::BeginSeq;
  for (const BagFile& file : files) {
    out << file.name;
  }
  out << YAML::EndSeq << YAML::Key << "files" << YAML::Value << YAML::BeginSeq;
  for (const BagFile& file : files) {
    put_file(out, file);
  }
  out << YAML::EndSeq << YAML::EndMap << YAML::EndMap;
  return fmt::format("{}\n", out.c_str());
}

}  // namespace trestle::record
