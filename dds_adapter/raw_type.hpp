#pragma once
#include <string>

#include "dds_adapter/copy_bytes.hpp"
#include "dds_adapter/fastdds_compat.hpp"

namespace trestle::dds::detail {

/// Told when the slices of a sample that is written are no longer needed.
class SliceLoan {
 public:
  virtual void slices_copied() = 0;

 protected:
  ~SliceLoan() = default;
};

/// The "sample" that Fast DDS handles for us: views of serialised bytes, never the bytes.
struct RawSample {
  std::span<const ByteView> slices;  ///< to write
  std::size_t size = 0;              ///< of all slices
  SliceLoan* loan = nullptr;         ///< of the slices; may be null
  ByteView received;                 ///< read: points into the payload that the loan keeps
};

/// Serialised samples of any one type.
class RawType final : public fast::AnyType {
 public:
  using AnyType::AnyType;

 private:
  std::uint32_t encoded_size(const void* sample) override {
    return static_cast<std::uint32_t>(static_cast<const RawSample*>(sample)->size);
  }

  bool encode(const void* sample, fast::Payload& payload) override {
    const auto& raw = *static_cast<const RawSample*>(sample);
    if (raw.size > payload.max_size) {
      return false;
    }
    auto* to = reinterpret_cast<std::byte*>(payload.data);
    for (const ByteView slice : raw.slices) {
      if (!slice.empty()) {
        copy_bytes(to, slice.data(), slice.size());
        to += slice.size();
      }
    }
    if (raw.loan != nullptr) {
      raw.loan->slices_copied();
    }
    payload.length = static_cast<std::uint32_t>(raw.size);
    payload.encapsulation = payload.data[1] == 0 ? CDR_BE : CDR_LE;
    return true;
  }

  /// Its result is ignored for loans; the reader judges the bytes.
  bool decode(fast::Payload& payload, void* sample) override {
    static_cast<RawSample*>(sample)->received = std::as_bytes(std::span{payload.data, payload.length});
    return true;
  }

  void* make() override { return new RawSample; }
  void destroy(void* sample) override { delete static_cast<RawSample*>(sample); }
};

/// Whether the bytes begin with an encapsulation header of plain XCDR1.
[[nodiscard]] inline bool is_plain_cdr(ByteView bytes) noexcept {
  return bytes.size() >= 4 && bytes[0] == std::byte{0} && bytes[1] <= std::byte{1};
}

}  // namespace trestle::dds::detail
