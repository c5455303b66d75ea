#pragma once
#include <boost/asio/posix/stream_descriptor.hpp>
#include <optional>
#include <string>

#include "bridge/cli/session.hpp"
#include "bridge/inspect/tools/listener.hpp"
#include "bridge/inspect/tools/picture.hpp"
#include "pcaps/live_capture.hpp"

namespace trestle::inspect {

/// Now, in the way that frames tell the time.
[[nodiscard]] TimePoint wall_clock();

/// Where to watch.
struct Where {
  std::string interface;
  std::optional<sd::NodeConfig> network;  ///< nothing: without an address, so that no group can be joined
};

/// Watches the frames of an interface or, without the right to see them, what SD sends to all.
class LiveWatch {
 public:
  /// @throws std::runtime_error when neither is possible.
  LiveWatch(cli::Session& session, const Where& where, std::uint16_t sd_port, Watcher::Handler handler);
  LiveWatch(const LiveWatch&) = delete;
  LiveWatch& operator=(const LiveWatch&) = delete;
  ~LiveWatch();

  /// To be called again and again.
  void on_time() { seen_.on_time(wall_clock()); }
  /// To be called when the session is over.
  /// @throws std::runtime_error when it ended because there is nothing to capture from any more.
  void check() const;

  [[nodiscard]] Watcher& seen() noexcept { return seen_; }
  [[nodiscard]] Picture picture(bool live) const;

 private:
  void capture(const Where& where);
  void wait();
  void on_readable();

  cli::Session& session_;
  TimePoint started_ = wall_clock();
  Watcher seen_;
  std::string where_;
  std::optional<pcaps::LiveCapture> capture_;
  std::optional<boost::asio::posix::stream_descriptor> readable_;
  std::optional<Listener> listener_;
};

}  // namespace trestle::inspect
