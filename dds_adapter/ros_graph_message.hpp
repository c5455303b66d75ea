#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// ROS 2's graph message, rmw_dds_common/msg/ParticipantEntitiesInfo: which nodes a participant has, and
/// which readers and writers each of them. Samples are serialised with their encapsulation header.
namespace trestle::dds::detail {

/// The id of a participant, reader or writer: the bytes of its GUID.
using Gid = std::array<std::byte, 16>;

/// How many bytes an id takes in the message: those behind the first 16 are zero.
enum class GidForm : std::uint8_t { iron = 16, humble = 24 };

struct NodeEntities {
  std::string name_space;  ///< "/" or absolute: "/sensing"
  std::string name;
  std::vector<Gid> readers;
  std::vector<Gid> writers;
  friend bool operator==(const NodeEntities&, const NodeEntities&) = default;
};

struct ParticipantEntities {
  Gid participant{};
  std::vector<NodeEntities> nodes;
  friend bool operator==(const ParticipantEntities&, const ParticipantEntities&) = default;
};

/// Little endian.
[[nodiscard]] std::vector<std::byte> encode(const ParticipantEntities& entities, GidForm form);

struct DecodedEntities {
  ParticipantEntities entities;
  GidForm form{};  ///< seen from the size: a message fits one form only
};

/// Of either byte order and form; nothing for other bytes. Takes a small multiple of `sample` in memory.
[[nodiscard]] std::optional<DecodedEntities> decode_entities(std::span<const std::byte> sample);

}  // namespace trestle::dds::detail
