#include "dds_adapter/ros_graph_message.hpp"

#include <algorithm>
#include <string_view>

namespace trestle::dds::detail {

namespace {

constexpr std::size_t encapsulation_bytes = 4;
constexpr std::size_t max_padding = 3;  // that DDS may put behind a sample
constexpr std::size_t name_characters_max = 256;

/// XCDR1: numbers of 4 bytes begin at multiples of 4, counted from behind the encapsulation header.
class GraphWriter {
 public:
  explicit GraphWriter(GidForm form) : form_{form} {}

  void u32(std::uint32_t value) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes_.push_back(static_cast<std::byte>(value >> shift));
    }
  }
  void text(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size() + 1));
    const auto characters = std::as_bytes(std::span{value});
    bytes_.insert(bytes_.end(), characters.begin(), characters.end());
    bytes_.push_back(std::byte{0});
  }
  void gid(const Gid& value) {
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.resize(bytes_.size() + static_cast<std::size_t>(form_) - value.size());
  }
  void gids(const std::vector<Gid>& values) {
    u32(static_cast<std::uint32_t>(values.size()));
    for (const Gid& value : values) {
      gid(value);
    }
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  GidForm form_;
  std::vector<std::byte> bytes_{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
};

class GraphReader {
 public:
  GraphReader(std::span<const std::byte> sample, GidForm form)
      : sample_{sample}, big_{sample[1] == std::byte{0}}, form_{form} {}

  std::uint32_t u32() {
    at_ = (at_ + 3) / 4 * 4;
    const auto bytes = take(4);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      value |= std::to_integer<std::uint32_t>(bytes[i]) << (8 * (big_ ? 3 - i : i));
    }
    return value;
  }
  std::string text() {
    const std::uint32_t size = u32();
    if (size == 0 || size > name_characters_max + 1) {
      failed_ = true;
      return {};
    }
    const auto bytes = take(size);
    if (bytes.empty() || bytes.back() != std::byte{0}) {
      failed_ = true;
      return {};
    }
    std::string value(size - 1, '\0');
    std::ranges::transform(bytes.first(size - 1), value.begin(),
                           [](std::byte b) { return static_cast<char>(b); });
    return value;
  }
  Gid gid() {
    Gid value{};
    const auto bytes = take(static_cast<std::size_t>(form_));
    if (!bytes.empty()) {
      std::ranges::copy(bytes.first(value.size()), value.begin());
    }
    return value;
  }
  std::vector<Gid> gids() {
    const std::uint32_t count = u32();
    std::vector<Gid> values;
    for (std::uint32_t i = 0; i < count && !failed_; ++i) {
      values.push_back(gid());
    }
    return values;
  }
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] bool ended() const { return !failed_ && sample_.size() - at_ <= max_padding; }

 private:
  /// Nothing when the sample ends first.
  std::span<const std::byte> take(std::size_t size) {
    if (failed_ || at_ > sample_.size() || sample_.size() - at_ < size) {
      failed_ = true;
      return {};
    }
    const auto bytes = sample_.subspan(at_, size);
    at_ += size;
    return bytes;
  }

  std::span<const std::byte> sample_;
  std::size_t at_ = encapsulation_bytes;
  bool big_;
  GidForm form_;
  bool failed_ = false;
};

}  // namespace

std::vector<std::byte> encode(const ParticipantEntities& entities, GidForm form) {
  GraphWriter out{form};
  out.gid(entities.participant);
  out.u32(static_cast<std::uint32_t>(entities.nodes.size()));
  for (const NodeEntities& node : entities.nodes) {
    out.text(node.name_space);
    out.text(node.name);
    out.gids(node.readers);
    out.gids(node.writers);
  }
  return out.take();
}

std::optional<DecodedEntities> decode_entities(std::span<const std::byte> sample) {
  if (sample.size() < encapsulation_bytes || sample[0] != std::byte{0} || sample[1] > std::byte{1}) {
    return std::nullopt;
  }
  for (const GidForm form : {GidForm::iron, GidForm::humble}) {
    GraphReader in{sample, form};
    DecodedEntities result{{in.gid(), {}}, form};
    const std::uint32_t count = in.u32();
    for (std::uint32_t i = 0; i < count && !in.failed(); ++i) {
      NodeEntities node;
      node.name_space = in.text();
      node.name = in.text();
      node.readers = in.gids();
      node.writers = in.gids();
      result.entities.nodes.push_back(std::move(node));
    }
    if (in.ended()) {
      return result;
    }
  }
  return std::nullopt;
}

}  // namespace trestle::dds::detail
