#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace trestle::conform {

/// Which code of a device was run: a file that both map. A device that is built with
/// fuzz/coverage_hook.c marks there what it runs; the environment variable TRESTLE_COVERAGE names the file.
class CoverageMap {
 public:
  static constexpr std::size_t size = 65'536;

  /// Makes the file, and sets the environment variable for the device that is started next.
  /// @throws std::runtime_error when the file cannot be made.
  explicit CoverageMap(const std::string& file);
  ~CoverageMap();
  CoverageMap(const CoverageMap&) = delete;
  CoverageMap& operator=(const CoverageMap&) = delete;

  /// Takes what was run since the last call.
  /// @return whether something was among it that was never run before.
  bool grown();
  /// How many places of the code were run so far; 0: the device has no hook.
  [[nodiscard]] std::size_t count() const noexcept { return count_; }

 private:
  std::uint8_t* map_ = nullptr;
  std::vector<bool> known_ = std::vector<bool>(size);
  std::size_t count_ = 0;
};

}  // namespace trestle::conform
