#include "bridge/inspect/tools/live_watch.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "someip/net/address_text.hpp"

namespace trestle::inspect {
namespace {

/// Frames that are taken before other handlers run.
constexpr int frames_at_a_time = 1000;

std::string program() {
  std::error_code error;
  const auto path = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "trestle" : path.string();
}

}  // namespace

TimePoint wall_clock() {
  return TimePoint{std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch())};
}

LiveWatch::LiveWatch(cli::Session& session, const Where& where, std::uint16_t sd_port,
                     Watcher::Handler handler)
    : session_{session}, seen_{sd_port, std::move(handler)}, where_{where.interface} {
  capture(where);
  if (!where.network) {
    return;
  }
  // Joining the group makes switches send its messages here; they are then seen in the captured frames.
  try {
    listener_.emplace(session.io, *where.network,
                      [this](ByteView datagram, const Endpoint& from, const Endpoint& to) {
                        if (!capture_) {
                          seen_.on_sd_datagram(datagram, from, to, wall_clock());
                        }
                      });
  } catch (const someip::NetError&) {
    if (!capture_) {
      throw;
    }
  }
}

LiveWatch::~LiveWatch() {
  if (readable_) {
    readable_->release();  // the capture owns the file descriptor
  }
}

void LiveWatch::capture(const Where& where) {
  try {
    capture_.emplace(where.interface);
  } catch (const pcaps::CaptureDenied& error) {
    const std::string hint =
        fmt::format("'sudo setcap cap_net_raw+ep {}' allows it, and so does sudo", program());
    if (!where.network) {
      throw std::runtime_error{std::string{error.what()} + ". " + hint};
    }
    cli::Session::note(
        fmt::format("note: {}: only what discovery sends to all is shown, no subscriptions and no traffic.\n"
                    "      {}",
                    error.what(), hint));
    where_ =
        fmt::format("{} from {}", someip::to_string(Endpoint{where.network->multicast, where.network->port}),
                    someip::to_string(where.network->address));
    return;
  }
  readable_.emplace(session_.io, capture_->fd());
  wait();
}

void LiveWatch::wait() {
  readable_->async_wait(boost::asio::posix::stream_descriptor::wait_read,
                        [this](const boost::system::error_code& error) {
                          if (!error) {
                            on_readable();
                          }
                        });
}

void LiveWatch::on_readable() {
  for (int i = 0; i < frames_at_a_time; ++i) {
    const auto frame = capture_->next();
    if (!frame) {
      break;
    }
    seen_.on_frame(*frame);
  }
  if (capture_->error().empty()) {
    wait();
  } else {
    session_.finish();
  }
}

void LiveWatch::check() const {
  if (capture_ && !capture_->error().empty()) {
    throw std::runtime_error{"the capture ended: " + capture_->error()};
  }
}

Picture LiveWatch::picture(bool live) const {
  return {.seen = seen_,
          .where = where_,
          .since = started_,
          .now = wall_clock(),
          .live = live,
          .traffic = capture_.has_value(),
          .dropped = capture_ ? capture_->dropped() : 0};
}

}  // namespace trestle::inspect
