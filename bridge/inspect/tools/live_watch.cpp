#include "bridge/inspect/tools/live_watch.hpp"

namespace trestle::inspect {

using traffic::wall_clock;

LiveWatch::LiveWatch(cli::Session& session, const traffic::Where& where, std::uint16_t sd_port,
                     Watcher::Handler handler)
    : seen_{sd_port, std::move(handler)},
      frames_{session, where, [this](const pcaps::Frame& frame) { seen_.on_frame(frame); },
              [this](ByteView datagram, const Endpoint& from, const Endpoint& to) {
                seen_.on_sd_datagram(datagram, from, to, wall_clock());
              }} {}

Picture LiveWatch::picture(bool live) const {
  return {.seen = seen_,
          .where = frames_.where(),
          .since = started_,
          .now = wall_clock(),
          .live = live,
          .traffic = frames_.captures(),
          .dropped = frames_.dropped()};
}

}  // namespace trestle::inspect
