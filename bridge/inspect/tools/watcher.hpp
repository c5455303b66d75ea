#pragma once
#include <functional>

#include "bridge/inspect/tools/traffic_view.hpp"
#include "bridge/traffic/capture_reader.hpp"
#include "bridge/traffic/network_view.hpp"

namespace trestle::inspect {

/// Makes a picture of a network from its frames, or, where they cannot be had, from SD's datagrams. Times are
/// those of the frames: wall-clock time since 1970, as TimePoint.
class Watcher : public traffic::MessageSink {
 public:
  using Handler = std::function<void(const std::vector<traffic::Sighting>& sightings, TimePoint now)>;

  /// @param sd_port  carries SOME/IP whatever it looks like.
  /// @param handler  is told what happens.
  Watcher(std::uint16_t sd_port, Handler handler);

  void on_frame(const pcaps::Frame& frame);
  /// The recording is over.
  void finish();
  /// Takes a datagram that came to SD.
  void on_sd_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to, TimePoint now);
  /// Notices what has expired.
  void on_time(TimePoint now);

  [[nodiscard]] traffic::NetworkView& network() noexcept { return network_; }
  [[nodiscard]] const traffic::NetworkView& network() const noexcept { return network_; }
  [[nodiscard]] TrafficView& traffic() noexcept { return traffic_; }
  [[nodiscard]] const TrafficView& traffic() const noexcept { return traffic_; }
  /// What is broken, from frames to SD messages.
  [[nodiscard]] std::uint64_t malformed() const noexcept;
  /// Of the first and the last frame.
  [[nodiscard]] TimePoint first() const noexcept { return first_.value_or(TimePoint{}); }
  [[nodiscard]] TimePoint last() const noexcept { return last_; }

 private:
  using traffic::MessageSink::undecodable;
  bool message(const traffic::Place& place, std::size_t offset, const someip::Message& message) override;
  void undecodable(const traffic::Place& place, std::size_t offset, ByteView bytes,
                   const traffic::Violation& violation) override;
  void broken_frame(const traffic::Place& place, const traffic::Violation& violation) override;
  void tell(const std::vector<traffic::Sighting>& sightings, TimePoint now);

  Handler handler_;
  traffic::NetworkView network_;
  TrafficView traffic_;
  traffic::CaptureReader reader_;
  pcaps::Traffic frames_{reader_};
  std::optional<TimePoint> first_;
  TimePoint last_{};
  std::uint64_t malformed_ = 0;
};

}  // namespace trestle::inspect
