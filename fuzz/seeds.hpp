// fuzz: one libFuzzer target for each decoder and each state machine. FILE.cpp states its property on top.
//
//   corpus/TARGET/       inputs that it begins with, and every input that has failed
//   cut_seeds.cpp        cuts inputs from the captures in pcaps/, with seeds.hpp and sd_conversation.hpp
//   payload_rules.hpp, conversion_plans.hpp, values_types.hpp  what several targets share
//   *.dict               words that a target's inputs are made of
//   plain_decoder.hpp    SOME/IP and service discovery from the specification alone, to compare with
//
// cmake/fuzz_all.sh runs all of them (`./run test fuzz`). An input that fails stays in corpus/, and becomes a
// test.
#pragma once
#include <concepts>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "someip/wire/bytes.hpp"

/// What cut_seeds makes: inputs that fuzz targets begin with.
namespace trestle::fuzz {

inline constexpr std::size_t max_seed_bytes = 4096;
inline constexpr std::size_t max_seeds = 400;  ///< of a target

/// An input under construction, its numbers big endian as the targets read them.
class Input {
 public:
  template <std::unsigned_integral T>
  void put(T number) {
    bytes_.resize(bytes_.size() + sizeof(T));
    someip::store(bytes_.data() + bytes_.size() - sizeof(T), number);
  }
  void put(ByteView bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void clear() noexcept { bytes_.clear(); }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }
  [[nodiscard]] ByteView bytes() const noexcept { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

inline std::string as_text(ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// The seeds of one target, in its folder.
class Seeds {
 public:
  Seeds(const std::filesystem::path& folder, const char* target) : folder_{folder / target} {
    std::filesystem::create_directories(folder_);
  }

  /// Writes a seed unless one of the same kind is there, it is too large or there are enough.
  void add(const std::string& kind, ByteView bytes) {
    if (bytes.size() > max_seed_bytes || kinds_.size() >= max_seeds || !kinds_.insert(kind).second) {
      return;
    }
    std::ofstream file{folder_ / std::to_string(kinds_.size()), std::ios::binary};
    file << as_text(bytes);
  }
  void add(ByteView bytes) { add(as_text(bytes), bytes); }
  [[nodiscard]] std::size_t size() const { return kinds_.size(); }

 private:
  std::filesystem::path folder_;
  std::set<std::string> kinds_;
};

}  // namespace trestle::fuzz
