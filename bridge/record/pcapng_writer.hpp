#pragma once
#include <string>
#include <system_error>
#include <vector>

#include "bridge/record/growing_file.hpp"
#include "pcaps/frame.hpp"

namespace trestle::record {

/// Writes frames as a pcapng file, with time stamps in nanoseconds: what Wireshark and `trestle decode` read.
class PcapngWriter {
 public:
  /// Makes the file, which must not be there yet.
  /// @param link  of all frames; not LinkType::unsupported.
  /// @throws std::system_error
  PcapngWriter(const std::string& path, pcaps::LinkType link);

  /// Adds a frame, which is written with others after it or by flush().
  /// @return why the frames that waited could not be written; lost() has grown by them.
  std::error_code write(const pcaps::Frame& frame);
  std::error_code flush();

  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  GrowingFile file_;
  std::vector<std::byte> waiting_;
  std::uint64_t waiting_frames_ = 0;
  std::uint64_t frames_ = 0;  ///< in the file
  std::uint64_t lost_ = 0;
};

}  // namespace trestle::record
