#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace trestle::test {

/// A message of test_msgs/srv/Add with Cyclone's header: a request, or a reply, whose sum is `a`.
struct CycloneAdd {
  std::uint64_t client = 0;
  std::int64_t number = 0;
  std::int64_t a = 0;
  std::int64_t b = 0;
  friend bool operator==(const CycloneAdd&, const CycloneAdd&) = default;
};

/// One end of the service /add as rmw_cyclonedds has it: Cyclone DDS, with code generated from add.idl.
class CycloneServicePeer {
 public:
  enum class Role : std::uint8_t { client, server };
  CycloneServicePeer(std::uint32_t domain, Role role);
  ~CycloneServicePeer();
  CycloneServicePeer(const CycloneServicePeer&) = delete;
  CycloneServicePeer& operator=(const CycloneServicePeer&) = delete;

  /// Whether both directions have been found.
  [[nodiscard]] bool matched() const;
  void send(const CycloneAdd& message);
  [[nodiscard]] std::optional<CycloneAdd> take();

 private:
  struct Entities;
  std::unique_ptr<Entities> entities_;
};

}  // namespace trestle::test
