#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dds_adapter/participant.hpp"

namespace trestle::test {

/// The topic and type of the peer's samples, as they are called on the wire.
inline constexpr const char* blob_topic = "rt/blobs";
inline constexpr const char* blob_type = "test_msgs::msg::dds_::Blob_";

/// A value of the type in blob.idl.
struct Blob {
  std::uint32_t number = 0;
  std::string text;
  std::vector<std::byte> data;
  friend bool operator==(const Blob&, const Blob&) = default;
};

/// A participant of another DDS implementation, Cyclone DDS, with code generated from blob.idl: what it reads
/// and writes has been through a (de)serialiser that is not ours. On loopback only.
class CyclonePeer {
 public:
  explicit CyclonePeer(std::uint32_t domain);
  ~CyclonePeer();
  CyclonePeer(const CyclonePeer&) = delete;
  CyclonePeer& operator=(const CyclonePeer&) = delete;

  void open_writer(const dds::Qos& qos);
  void open_reader(const dds::Qos& qos);
  [[nodiscard]] std::size_t readers_matched() const;  ///< by our writer
  [[nodiscard]] std::size_t writers_matched() const;  ///< by our reader
  void write(const Blob& blob);
  [[nodiscard]] std::optional<Blob> take();

 private:
  struct Entities;
  std::unique_ptr<Entities> entities_;
};

}  // namespace trestle::test
