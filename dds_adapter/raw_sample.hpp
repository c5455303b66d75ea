#pragma once
#include <cstddef>
#include <span>

#include "dds_adapter/participant.hpp"

namespace trestle::dds::detail {

/// Told when the pieces of a sample that is written are no longer needed.
class PieceLoan {
 public:
  virtual void pieces_copied() = 0;

 protected:
  ~PieceLoan() = default;
};

/// The "sample" that Fast DDS handles for us: views of serialised bytes, never the bytes.
struct RawSample {
  std::span<const ByteView> pieces;  ///< to write
  std::size_t size = 0;              ///< of all pieces
  PieceLoan* loan = nullptr;         ///< of the pieces; may be null
  ByteView received;                 ///< read: points into the payload that the loan keeps
};

}  // namespace trestle::dds::detail
