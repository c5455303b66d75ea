#pragma once
#include <functional>

#include "bridge/inspect/tools/traffic_view.hpp"
#include "bridge/traffic/capture_reader.hpp"
#include "bridge/traffic/network_view.hpp"

namespace trestle::inspect {

/// Makes a picture of a network from its frames, or, where they cannot be had, from SD's datagrams. Times are
/// those of the frames: wall-clock time since 1970, as TimePoint.
class Watcher : public MessageSink {
 public:
  using Handler = std::function<void(const std::vector<Sighting>& sightings, TimePoint now)>;

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

  [[nodiscard]] NetworkView& network() noexcept { return network_; }
  [[nodiscard]] const NetworkView& network() const noexcept { return network_; }
  [[nodiscard]] TrafficView& traffic() noexcept { return traffic_; }
  [[nodiscard]] const TrafficView& traffic() const noexcept { return traffic_; }
  /// What is broken, from frames to SD messages.
  [[nodiscard]] std::uint64_t malformed() const noexcept;
  /// Of the first and the last frame.
  [[nodiscard]] TimePoint first() const noexcept { return first_.value_or(TimePoint{}); }
  [[nodiscard]] TimePoint last() const noexcept { return last_; }

 private:
  using MessageSink::undecodable;
  bool message(const Place& place, std::size_t offset, const someip::Message& message) override;
  void undecodable(const Place& place, std::size_t offset, ByteView bytes,
                   const Violation& violation) override;
  void broken_frame(const Place& place, const Violation& violation) override;
  void tell(const std::vector<Sighting>& sightings, TimePoint now);

  Handler handler_;
  NetworkView network_;
  TrafficView traffic_;
  CaptureReader reader_;
  pcaps::Traffic frames_{reader_};
  std::optional<TimePoint> first_;
  TimePoint last_{};
  std::uint64_t malformed_ = 0;
};

}  // namespace trestle::inspect
