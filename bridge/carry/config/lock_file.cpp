#include "bridge/carry/config/lock_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <system_error>

#include "bridge/carry/config/elements.hpp"
#include "bridge/documents/document.hpp"

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

std::string why() {
  return std::generic_category().message(errno);
}

/// Closes the file in any case.
class OpenFile {
 public:
  OpenFile(const std::string& file, int flags) : number_{::open(file.c_str(), flags | O_CLOEXEC, 0666)} {}
  ~OpenFile() { close(); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  [[nodiscard]] bool is_open() const noexcept { return number_ >= 0; }
  [[nodiscard]] bool write(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = ::write(number_, text.data(), text.size());
      if (written < 0 && errno != EINTR) {
        return false;
      }
      text.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
    }
    return true;
  }
  /// Empties the file, unless another process is writing it at this time.
  [[nodiscard]] bool take() const {
    return ::flock(number_, LOCK_EX | LOCK_NB) == 0 && ::ftruncate(number_, 0) == 0;
  }
  [[nodiscard]] bool sync() const { return ::fsync(number_) == 0; }
  bool close() {
    const int number = std::exchange(number_, -1);
    return number < 0 || ::close(number) == 0;
  }

 private:
  int number_;
};

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
  if (auto written = replace_file(file_, text); !written) {
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

tl::expected<void, std::string> replace_file(const std::string& file, std::string_view text) {
  std::error_code none;
  const std::filesystem::path linked = std::filesystem::canonical(file, none);
  const std::string target = none ? file : linked.string();
  const std::string beside = target + ".new";
  const auto fail = [&](const std::string& what) {
    const std::string message = fmt::format("{} cannot be written: {}: {}", file, what, why());
    ::unlink(beside.c_str());
    return tl::unexpected{message};
  };
  {
    OpenFile out{beside, O_WRONLY | O_CREAT | O_NOFOLLOW};
    if (!out.is_open() || !out.take()) {
      return tl::unexpected{fmt::format("{} cannot be written: {}: {}", file, beside, why())};
    }
    if (!out.write(text) || !out.sync() || !out.close()) {
      return fail(beside);
    }
  }
  if (::rename(beside.c_str(), target.c_str()) != 0) {
    return fail(target);
  }
  // So that the new name survives a power failure. Not every file system can do this; then the file is
  // written all the same.
  const std::filesystem::path folder = std::filesystem::path{target}.parent_path();
  const OpenFile place{folder.empty() ? "." : folder.string(), O_RDONLY | O_DIRECTORY};
  [[maybe_unused]] const bool is_safe = place.is_open() && place.sync();
  return {};
}

}  // namespace trestle::carry
