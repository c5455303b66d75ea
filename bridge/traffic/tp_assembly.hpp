#pragma once
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "someip/core/tp_reassembler.hpp"

namespace trestle::traffic {

/// A sender and a receiver. A recording has one sender's segments to several receivers, so the sender alone
/// does not say which segments belong together.
struct Flow {
  Endpoint from;
  Endpoint to;
  friend bool operator<(const Flow& a, const Flow& b) noexcept {
    return std::tie(a.from, a.to) < std::tie(b.from, b.to);
  }
};

/// The TP reassembler with memory of its own, for all flows of a recording.
class TpAssembly {
 public:
  TpAssembly();

  /// As TpReassembler::on_segment().
  [[nodiscard]] someip::Result<std::optional<someip::Reassembled>, someip::TpDrop> add(
      const Flow& flow, const someip::Message& segment, TimePoint now);

  /// Messages of which segments came, but never all.
  [[nodiscard]] std::uint64_t incomplete() const noexcept;

 private:
  std::vector<std::unique_ptr<std::byte[]>> buffers_;
  std::vector<std::unique_ptr<std::uint32_t[]>> maps_;
  std::vector<someip::TpSlot> slots_;
  std::map<Flow, std::uint32_t> flows_;
  std::optional<someip::TpReassembler> reassembler_;
};

}  // namespace trestle::traffic
