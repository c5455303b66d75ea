#include "bridge/carry/config/lock_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include "bridge/carry/config/elements.hpp"
#include "bridge/documents/document.hpp"
#include "bridge/documents/replace_file.hpp"

namespace trestle::carry {
namespace {

constexpr const char* comment =
    "# The ids of topics that `trestle bridge` discovered (`patterns` in its configuration): it adds what "
    "is\n"
    "# new, and never changes or removes a line. Keep this file together with the configuration, and copy "
    "it\n"
    "# to bridges at the other end. To give an id up, remove its line and send SIGHUP to the bridge.\n";

LockedTopic load_topic(const YAML::Node& node, documents::Problems& problems) {
  LockedTopic locked;
  documents::Section section{node, "topic", problems};
  locked.mark = section.mark();
  section.require("service", documents::as<someip::ServiceId>(documents::id_number(0x0001, 0xfffd)),
                  locked.service);
  section.require("topic", topic_name(), locked.topic);
  section.require("type", type_name(), locked.type);
  section.read("durability", durability(), locked.transient_local);
  section.finish();
  return locked;
}

void report_duplicates(const std::vector<LockedTopic>& topics, documents::Problems& problems) {
  std::map<std::string, documents::Mark> names;
  std::map<someip::ServiceId, const LockedTopic*> ids;
  for (const LockedTopic& one : topics) {
    const auto [name, new_name] = names.try_emplace(one.topic, one.mark);
    if (!new_name) {
      problems.error(one.mark, fmt::format("topic: {} stands here twice, first in line {}: remove the line "
                                           "whose id nobody uses",
                                           one.topic, name->second.line));
    }
    const auto [id, new_id] = ids.try_emplace(one.service, &one);
    if (!new_id) {
      problems.error(one.mark,
                     fmt::format("service: 0x{:04x} is that of {} in line {}: remove one of the "
                                 "two lines",
                                 someip::value(one.service), id->second->topic, id->second->mark.line));
    }
  }
}

std::vector<LockedTopic> load_lock(const YAML::Node& node, documents::Problems& problems) {
  documents::Section section{node, "", problems};
  int version = 0;
  section.require("version",
                  documents::Format<int>{
                      "1, the only one that this program knows",
                      [](std::string_view text) { return text == "1" ? std::optional{1} : std::nullopt; }},
                  version);
  std::vector<LockedTopic> topics;
  for (const YAML::Node& topic :
       section.required_list("topics", "a list of topics (remove the file to begin anew)")) {
    topics.push_back(load_topic(topic, problems));
  }
  section.finish();
  return topics;
}

}  // namespace

tl::expected<LockFile, std::vector<documents::Problem>> LockFile::read(const std::string& file) {
  LockFile lock;
  lock.file_ = file;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return lock;
  }
  documents::Problems problems{file};
  if (auto text = documents::read_text_file(file)) {
    lock.text_ = std::move(*text);
    if (const YAML::Node node = documents::parse_document(
            lock.text_, "'version' and 'topics' (remove the file to begin anew)", problems)) {
      lock.topics_ = load_lock(node, problems);
    }
  } else {
    problems.error(documents::Mark{}, text.error());
  }
  if (!problems.has_errors()) {
    report_duplicates(lock.topics_, problems);
  }
  if (problems.has_errors()) {
    return tl::unexpected{problems.take()};
  }
  std::ranges::sort(lock.topics_, {}, &LockedTopic::topic);
  return lock;
}

const LockedTopic* LockFile::find(std::string_view topic) const {
  const auto at = std::ranges::lower_bound(topics_, topic, {}, &LockedTopic::topic);
  return at != topics_.end() && at->topic == topic ? &*at : nullptr;
}

bool LockFile::has(someip::ServiceId service) const {
  return std::ranges::find(topics_, service, &LockedTopic::service) != topics_.end();
}

tl::expected<void, std::string> LockFile::add(const std::vector<LockedTopic>& more) {
  std::error_code ignored;
  if (std::filesystem::exists(file_, ignored) || !text_.empty()) {
    const auto now = documents::read_text_file(file_);
    if (!now || *now != text_) {
      return tl::unexpected{fmt::format(
          "{} was changed or removed since this bridge read it; send SIGHUP to read it again", file_)};
    }
  }
  std::vector<LockedTopic> topics = topics_;
  topics.insert(topics.end(), more.begin(), more.end());
  std::ranges::sort(topics, {}, &LockedTopic::topic);
  std::string text = lock_text(topics);
  if (auto written = documents::replace_file(file_, text, documents::Outlives::a_power_failure); !written) {
    return written;
  }
  text_ = std::move(text);
  topics_ = std::move(topics);
  return {};
}

std::string lock_text(const std::vector<LockedTopic>& topics) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "version" << YAML::Value << 1;
  out << YAML::Key << "topics" << YAML::Value << YAML::BeginSeq;
  for (const LockedTopic& one : topics) {
    out << YAML::Flow << YAML::BeginMap;
    out << YAML::Key << "service" << YAML::Value << fmt::format("0x{:04x}", someip::value(one.service));
    out << YAML::Key << "topic" << YAML::Value << one.topic;
    out << YAML::Key << "type" << YAML::Value << one.type;
    if (one.transient_local) {
      out << YAML::Key << "durability" << YAML::Value << "transient_local";
    }
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  return std::string{comment} + out.c_str() + "\n";
}

}  // namespace trestle::carry
