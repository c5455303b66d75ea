#pragma once
#include <functional>

#include "bridge/traffic/capture_reader.hpp"
#include "bridge/traffic/network_view.hpp"
#include "bridge/traffic/tp_assembly.hpp"

namespace trestle::carry {

/// The SOME/IP messages of frames: as they are on the wire, but for segments, which are put together.
class SomeipMessages : private traffic::MessageSink {
 public:
  /// Told of each message, which is valid during the call. What discovery says of it is known already.
  using OnMessage = std::function<void(const traffic::Place& place, const someip::Message& message)>;

  SomeipMessages(std::uint16_t sd_port, OnMessage on_message);

  void on_frame(const pcaps::Frame& frame) { frames_.on_frame(frame); }
  /// No more frames come.
  void finish();

  /// What discovery has told so far.
  [[nodiscard]] const traffic::NetworkView& network() const noexcept { return network_; }
  /// Messages, segments, and what looked like some: grows with each frame that carries SOME/IP over UDP.
  [[nodiscard]] std::uint64_t found() const noexcept { return found_; }
  /// Bytes that are no message, and frames that are damaged.
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
  /// Messages of which segments are missing.
  [[nodiscard]] std::uint64_t incomplete() const noexcept { return segments_.incomplete(); }

 private:
  bool message(const traffic::Place& place, std::size_t offset, const someip::Message& message) override;
  void undecodable(const traffic::Place& place, std::size_t offset, ByteView bytes,
                   const traffic::Violation& violation) override;
  void broken_frame(const traffic::Place& place, const traffic::Violation& violation) override;

  OnMessage on_message_;
  traffic::NetworkView network_;
  traffic::CaptureReader reader_;
  pcaps::Traffic frames_;
  traffic::TpAssembly segments_;
  std::uint64_t found_ = 0;
  std::uint64_t malformed_ = 0;
};

}  // namespace trestle::carry
