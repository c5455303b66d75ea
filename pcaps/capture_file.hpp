#pragma once
#include <memory>
#include <optional>
#include <string>

#include "pcaps/frame.hpp"

struct pcap;

namespace trestle::pcaps {

/// A recorded capture, pcap or pcapng, read frame by frame.
class CaptureFile {
 public:
  /// Opens `path`; "-" is standard input. Throws std::runtime_error, naming path and reason, when it cannot
  /// be read or is no capture. A pcapng file may hold several interfaces if they are all of one link type.
  explicit CaptureFile(const std::string& path);

  /// The next frame, or nothing at the end and after a failure; error() tells these apart. The frame's bytes
  /// live until the next call.
  [[nodiscard]] std::optional<Frame> next();

  /// Why reading stopped before the end of the file (cut off, say); empty while all is well.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }

 private:
  struct Close {
    void operator()(pcap* file) const noexcept;
  };
  std::unique_ptr<pcap, Close> file_;
  LinkType link_ = LinkType::unsupported;
  std::uint64_t frames_ = 0;
  std::string error_;
};

}  // namespace trestle::pcaps
