#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "bridge/traffic/tp_assembly.hpp"
#include "someip/wire/header.hpp"

namespace trestle::inspect {

/// Messages and bytes a second.
struct Rate {
  double messages = 0;
  double bytes = 0;
};

/// Counts by the second, to tell the rate of the last five.
class RecentRate {
 public:
  void add(TimePoint now, std::uint64_t messages, std::uint64_t bytes);
  /// Of the last five whole seconds, or as many as there were since the first message.
  [[nodiscard]] Rate per_second(TimePoint now) const;

 private:
  static constexpr std::int64_t window_s = 5;
  struct Bucket {
    std::int64_t second = -1;
    std::uint64_t messages = 0;
    std::uint64_t bytes = 0;
  };
  std::optional<std::int64_t> first_;
  std::array<Bucket, window_s + 1> buckets_{};
};

/// An event or a method of one server, as it is seen on the wire. What goes to several receivers counts once
/// for each; segments count as the message that they make up, when the last one comes.
struct SeenTraffic {
  someip::ServiceId service{};
  someip::MethodId method{};
  Endpoint server{};
  Transport transport = Transport::udp;
  bool event = false;
  std::uint64_t messages = 0;  ///< notifications; or requests
  std::uint64_t bytes = 0;     ///< of SOME/IP, headers included; of methods also those of answers
  std::uint64_t answers = 0;   ///< responses and errors
  std::uint64_t errors = 0;
  std::uint64_t skipped = 0;  ///< events whose Session IDs are missing: lost, or not recorded
  TimePoint first_seen{};
  TimePoint last_seen{};
  RecentRate recent{};

  /// Over all the time from the first message to the last; 0 until there were two.
  [[nodiscard]] Rate mean() const;
  /// Half of the last calls took less; nothing until one was answered.
  [[nodiscard]] std::optional<Duration> median_latency() const;
  void add_latency(Duration latency);

 private:
  static constexpr std::size_t kept_latencies = 128;
  std::vector<Duration> latencies_{};  ///< a ring
  std::size_t oldest_ = 0;
};

/// What a TrafficView took, and what it could not.
struct TrafficViewCounters {
  std::uint64_t messages = 0;
  std::uint64_t not_kept = 0;  ///< messages of events and methods there was no room for
  /// Messages of a type that does not exist, or segments that contradict themselves.
  std::uint64_t strange = 0;
};

/// What is sent beside service discovery: events and calls, with rates, losses and latencies.
class TrafficView {
 public:
  struct Limits {
    std::size_t max_rows = 10'000;   ///< events and methods
    std::size_t max_calls = 10'000;  ///< without an answer yet; one more drops the oldest
  };

  TrafficView() : TrafficView{Limits{}} {}
  explicit TrafficView(const Limits& limits) : limits_{limits} {}

  /// Takes a message that is none of SD. Magic cookies are passed over.
  void on_message(const someip::Message& message, const traffic::Flow& flow, Transport transport,
                  TimePoint now);
  /// Forgets events and methods that were not seen since then.
  void forget_idle(TimePoint since);

  using Key = std::tuple<someip::ServiceId, someip::MethodId, Endpoint, Transport, bool>;
  /// By service, method or event, server, protocol, and whether it is an event.
  [[nodiscard]] const std::map<Key, SeenTraffic>& rows() const noexcept { return rows_; }
  [[nodiscard]] const TrafficViewCounters& counters() const noexcept { return counters_; }
  /// Of all messages.
  [[nodiscard]] const RecentRate& recent() const noexcept { return recent_; }

 private:
  /// Tells a call from all others that are under way.
  using CallKey = std::tuple<traffic::Flow, someip::ServiceId, someip::MethodId, std::uint32_t>;
  /// Whose Session IDs count up together: some stacks count for each event (service, event, server), some for
  /// all events of a service (event 0, no port).
  using SessionKey = std::tuple<someip::ServiceId, someip::MethodId, Endpoint>;

  SeenTraffic* row_of(const someip::Header& header, const Endpoint& server, Transport transport, bool event,
                      TimePoint now);
  void on_session(SeenTraffic& row, someip::SessionId session);
  void on_request(const someip::Header& header, const traffic::Flow& flow, TimePoint now);
  void on_answer(SeenTraffic& row, const someip::Header& header, const traffic::Flow& flow, TimePoint now);

  Limits limits_;
  std::map<Key, SeenTraffic> rows_;
  std::map<SessionKey, someip::SessionId> sessions_;
  std::map<CallKey, TimePoint> calls_;
  std::deque<CallKey> call_order_;  ///< oldest first; those answered meanwhile included
  RecentRate recent_;
  TrafficViewCounters counters_;
};

}  // namespace trestle::inspect
