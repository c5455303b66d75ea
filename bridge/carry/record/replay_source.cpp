#include "bridge/carry/record/replay_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <deque>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <tuple>

#include "bridge/carry/record/someip_messages.hpp"
#include "bridge/record/mcap_reader.hpp"
#include "bridge/record/offered_qos.hpp"
#include "pcaps/capture_file.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

namespace fs = std::filesystem;

/// "127.0.0.1:30509", "[fe80::1]:30509", as to_string() writes it.
std::optional<Endpoint> endpoint_of(const record::Texts& metadata, const char* name) {
  const auto found = metadata.find(name);
  if (found == metadata.end()) {
    return std::nullopt;
  }
  std::string_view text = found->second;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) {
    return std::nullopt;
  }
  const std::string_view port = text.substr(colon + 1);
  text = text.substr(0, colon);
  if (text.starts_with('[') && text.ends_with(']')) {
    text = text.substr(1, text.size() - 2);
  }
  const auto address = someip::parse_address(std::string{text});
  Endpoint endpoint;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), endpoint.port);
  if (!address || error != std::errc{} || end != port.data() + port.size()) {
    return std::nullopt;
  }
  endpoint.address = *address;
  return endpoint;
}

/// What messages of a channel are.
struct Meaning {
  const RecordedTopic* topic = nullptr;
  std::optional<RecordedMessage> someip{};  ///< all but the message
};

/// One MCAP file, or those of a bag behind each other.
class McapSource final : public ReplaySource {
 public:
  explicit McapSource(std::vector<std::string> paths) : paths_{std::move(paths)} {
    for (const std::string& path : paths_) {
      record::McapReader reader{path};
      const auto overview = reader.overview();
      if (!overview) {
        fail(path, overview.error());
      }
      std::map<std::uint16_t, Meaning> meanings;
      for (const auto& [id, channel] : overview->channels) {
        meanings.emplace(id, meaning_of(channel, overview->schemas));
      }
      meanings_.push_back(std::move(meanings));
    }
    reader_.emplace(paths_.front());
  }

  std::optional<Replayed> next() override {
    for (;;) {
      const auto message = reader_->next();
      if (!message) {
        fail(paths_[at_], message.error());
      }
      if (*message) {
        if (auto replayed = replayed_of(**message)) {
          return replayed;
        }
        ++unknown_;
        continue;
      }
      if (const auto cut = reader_->cut_off()) {
        remark_ = fmt::format("{} was not finished: it is whole up to byte {}", paths_[at_], *cut);
      }
      if (at_ + 1 == paths_.size()) {
        return std::nullopt;
      }
      reader_.emplace(paths_[++at_]);
    }
  }

  void rewind() override {
    at_ = 0;
    reader_.emplace(paths_.front());
  }

  std::vector<const RecordedTopic*> topics() const override {
    std::vector<const RecordedTopic*> all;
    for (const auto& [name, topic] : topics_) {
      all.push_back(&topic);
    }
    return all;
  }
  std::string remark() const override { return remark_; }
  std::uint64_t unknown() const override { return unknown_; }

 private:
  [[noreturn]] static void fail(const std::string& path, const record::McapFault& fault) {
    throw std::runtime_error{fmt::format("{} is damaged {}", path, to_string(fault))};
  }

  Meaning meaning_of(const record::Channel& channel, const std::map<std::uint16_t, record::Schema>& schemas) {
    Meaning meaning;
    const auto schema = schemas.find(channel.schema);
    if (channel.encoding == "cdr" && schema != schemas.end()) {
      const auto text = [&](const char* name) {
        const auto found = channel.metadata.find(name);
        return found == channel.metadata.end() ? std::string{} : found->second;
      };
      const std::vector<dds::Qos> writers = record::writers_of(text("offered_qos_profiles"));
      const auto [at, is_new] = topics_.try_emplace({channel.topic, schema->second.name},
                                                    RecordedTopic{.name = channel.topic,
                                                                  .type = schema->second.name,
                                                                  .qos = record::most_of(writers),
                                                                  .hash = text("topic_type_hash")});
      if (!is_new) {
        at->second.qos = record::most_of(std::vector{at->second.qos, record::most_of(writers)});
      }
      meaning.topic = &at->second;
    } else if (channel.encoding == "someip") {
      const auto from = endpoint_of(channel.metadata, "from");
      const auto to = endpoint_of(channel.metadata, "to");
      const auto transport = channel.metadata.find("transport");
      if (from && to && transport != channel.metadata.end()) {
        meaning.someip =
            RecordedMessage{.transport = transport->second == "tcp" ? Transport::tcp : Transport::udp,
                            .from = *from,
                            .to = *to};
      }
    }
    return meaning;
  }

  [[nodiscard]] std::optional<Replayed> replayed_of(const record::Entry& entry) const {
    const auto found = meanings_[at_].find(entry.channel);
    const Meaning meaning =
        found == meanings_[at_].end() ? Meaning{} : found->second;  // the summary lacks it
    Replayed replayed{.time = entry.log_time};
    if (meaning.topic != nullptr) {
      replayed.topic = meaning.topic;
      replayed.sample = entry.data;
      return replayed;
    }
    const auto message = meaning.someip ? someip::decode(entry.data) : someip::Result<someip::Message>{};
    if (!meaning.someip || !message) {
      return std::nullopt;
    }
    replayed.someip = meaning.someip;
    replayed.someip->message = *message;
    return replayed;
  }

  std::vector<std::string> paths_;
  std::map<std::pair<std::string, std::string>, RecordedTopic> topics_;  ///< by name and type
  std::vector<std::map<std::uint16_t, Meaning>> meanings_;               ///< by file and channel
  std::size_t at_ = 0;
  std::optional<record::McapReader> reader_;
  std::string remark_;
  std::uint64_t unknown_ = 0;
};

/// The SOME/IP messages of a capture.
class CaptureSource final : public ReplaySource {
 public:
  CaptureSource(std::string path, std::uint16_t sd_port) : path_{std::move(path)}, sd_port_{sd_port} {
    begin();
  }

  std::optional<Replayed> next() override {
    if (!waiting_.empty() && is_given_) {
      waiting_.pop_front();
    }
    is_given_ = false;
    while (waiting_.empty()) {
      const auto frame = file_->next();
      if (frame) {
        messages_->on_frame(*frame);
        continue;
      }
      if (is_over_) {
        return std::nullopt;
      }
      is_over_ = true;
      messages_->finish();
    }
    is_given_ = true;
    Waiting& one = waiting_.front();
    one.replayed.someip->message.payload = one.payload;
    return one.replayed;
  }

  void rewind() override { begin(); }

  std::string remark() const override {
    return file_->error().empty() ? ""
                                  : fmt::format("{} cannot be read to its end: {}", path_, file_->error());
  }

 private:
  struct Waiting {
    std::vector<std::byte> payload{};
    Replayed replayed{};
  };

  void begin() {
    waiting_.clear();
    is_over_ = false;
    is_given_ = false;
    file_.emplace(path_);
    messages_.emplace(sd_port_, [this](const traffic::Place& place, const someip::Message& message) {
      waiting_.push_back(
          {.payload = {message.payload.begin(), message.payload.end()},
           .replayed = {.time = static_cast<record::LogTime>(place.time.time_since_epoch().count()),
                        .someip = RecordedMessage{.message = {.header = message.header},
                                                  .transport = place.transport.value_or(Transport::udp),
                                                  .from = place.flow.from,
                                                  .to = place.flow.to}}});
    });
  }

  std::string path_;
  std::uint16_t sd_port_;
  std::optional<pcaps::CaptureFile> file_;
  std::optional<SomeipMessages> messages_;
  std::deque<Waiting> waiting_;  ///< of one frame, as a rule
  bool is_given_ = false;        ///< the first of them
  bool is_over_ = false;
};

/// The files of a bag, in the order of their numbers: "drive_2.mcap" is before "drive_10.mcap".
std::vector<std::string> files_of_bag(const std::string& folder) {
  std::vector<fs::path> found;
  for (const fs::directory_entry& one : fs::directory_iterator{folder}) {
    if (one.path().extension() == ".mcap") {
      found.push_back(one.path());
    }
  }
  if (found.empty()) {
    throw std::runtime_error{fmt::format("{} has no MCAP file", folder)};
  }
  std::ranges::sort(found, {}, [](const fs::path& path) {
    const std::string name = path.string();
    return std::tuple{name.size(), name};
  });
  return {found.begin(), found.end()};
}

bool is_mcap(const std::string& path) {
  std::array<char, record::mcap_magic.size()> front{};
  std::ifstream in{path, std::ios::binary};
  return in.read(front.data(), front.size()) &&
         std::ranges::equal(std::as_bytes(std::span{front}), std::as_bytes(std::span{record::mcap_magic}));
}

}  // namespace

std::unique_ptr<ReplaySource> open_recording(const std::string& path, std::uint16_t sd_port) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    return std::make_unique<McapSource>(files_of_bag(path));
  }
  if (is_mcap(path)) {
    return std::make_unique<McapSource>(std::vector{path});
  }
  return std::make_unique<CaptureSource>(path, sd_port);
}

}  // namespace trestle::carry
