// bridge/traffic/live: SOME/IP on a network that is there now.
//
//   live_frames.hpp  the frames of an interface, or what service discovery sends to all
//   listener.hpp     hears service discovery, and asks
#pragma once
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bridge/cli/options.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/traffic/live/listener.hpp"
#include "pcaps/live_capture.hpp"

namespace trestle::traffic {

/// Now, in the way that frames tell the time.
[[nodiscard]] TimePoint wall_clock();

/// Where to watch.
struct Where {
  std::string interface;
  std::optional<sd::NodeConfig> network;  ///< nothing: without an address, so that no group can be joined
};

/// @param interface  to capture from, or "any"; empty: that of the network's own address.
/// @throws someip::NetError when the own address is of no interface.
[[nodiscard]] Where where_of(const std::string& interface, const cli::NetworkOptions& network);

/// The frames of an interface or, without the right to see them, what SD sends to all.
class LiveFrames {
 public:
  using OnFrame = std::function<void(const pcaps::Frame& frame)>;

  /// @throws std::runtime_error when neither is possible.
  LiveFrames(cli::Session& session, const Where& where, OnFrame on_frame, Listener::Handler on_sd_datagram);
  LiveFrames(const LiveFrames&) = delete;
  LiveFrames& operator=(const LiveFrames&) = delete;
  ~LiveFrames();

  /// To be called when the session is over.
  /// @throws std::runtime_error when it ended because there is nothing to capture from any more.
  void check() const;
  /// What is watched, for people.
  [[nodiscard]] const std::string& where() const noexcept { return where_; }
  /// Whether there are frames.
  [[nodiscard]] bool captures() const noexcept { return capture_.has_value(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return capture_ ? capture_->dropped() : 0; }

 private:
  void capture(const Where& where);
  void wait();
  void on_readable();

  cli::Session& session_;
  OnFrame on_frame_;
  std::string where_;
  std::optional<pcaps::LiveCapture> capture_;
  std::optional<boost::asio::posix::stream_descriptor> readable_;
  std::optional<Listener> listener_;
};

}  // namespace trestle::traffic
