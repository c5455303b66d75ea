#pragma once
#include "bridge/inspect/tools/picture.hpp"
#include "bridge/traffic/live/live_frames.hpp"

namespace trestle::inspect {

/// Watches what there is to see of a network.
class LiveWatch {
 public:
  /// @throws std::runtime_error when there is nothing to see.
  LiveWatch(cli::Session& session, const traffic::Where& where, std::uint16_t sd_port,
            Watcher::Handler handler);

  /// To be called again and again.
  void on_time() { seen_.on_time(traffic::wall_clock()); }
  /// As LiveFrames::check().
  void check() const { frames_.check(); }

  [[nodiscard]] Watcher& seen() noexcept { return seen_; }
  [[nodiscard]] Picture picture(bool live) const;

 private:
  TimePoint started_ = traffic::wall_clock();
  Watcher seen_;
  traffic::LiveFrames frames_;
};

}  // namespace trestle::inspect
