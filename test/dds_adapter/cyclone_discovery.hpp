#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace trestle::test {

/// What a participant of Cyclone DDS learns of others by discovery: the user data (USER_DATA) of each.
class CycloneDiscovery {
 public:
  explicit CycloneDiscovery(std::uint32_t domain);
  ~CycloneDiscovery();
  CycloneDiscovery(const CycloneDiscovery&) = delete;
  CycloneDiscovery& operator=(const CycloneDiscovery&) = delete;

  [[nodiscard]] std::vector<std::string> participants() const;  ///< itself among them, with none
  [[nodiscard]] std::vector<std::string> writers(const std::string& topic) const;
  [[nodiscard]] std::vector<std::string> readers(const std::string& topic) const;

 private:
  struct Entities;
  std::unique_ptr<Entities> entities_;
};

}  // namespace trestle::test
