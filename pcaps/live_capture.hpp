#pragma once
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "pcaps/frame.hpp"

struct pcap;

namespace trestle::pcaps {

/// The system does not let this process capture.
class CaptureDenied : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The frames that pass a network interface now. Never blocks: wait for fd() to become readable.
class LiveCapture {
 public:
  /// @param interface  such as "eth0"; "any" is all of them.
  /// @throws CaptureDenied without the right to capture (CAP_NET_RAW); std::runtime_error, with interface and
  ///         reason, when capturing fails for another reason.
  explicit LiveCapture(const std::string& interface);

  /// The next frame; nothing when none is waiting, or after a failure. Its bytes live until the next call.
  [[nodiscard]] std::optional<Frame> next();
  /// Readable when frames wait; it stays ours.
  [[nodiscard]] int fd() const noexcept { return fd_; }

  /// Why nothing more will come (the interface is gone, say); empty while all is well.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  /// Frames that were lost because next() was not called often enough.
  [[nodiscard]] std::uint64_t dropped() const noexcept;

 private:
  struct Close {
    void operator()(pcap* handle) const noexcept;
  };
  std::unique_ptr<pcap, Close> handle_;
  LinkType link_ = LinkType::unsupported;
  std::uint64_t frames_ = 0;
  int fd_ = -1;
  std::string error_;
};

}  // namespace trestle::pcaps
