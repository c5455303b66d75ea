#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "dds_adapter/service.hpp"

/// What clients and servers have in common.
namespace trestle::dds::detail {

/// Of both endpoints of both ends: nothing that fits `max_calls` is overwritten.
[[nodiscard]] Qos service_qos(const ServiceConfig& config);

/// Asks the owner for work(), once until it has come. For all threads.
class WakeOnce {
 public:
  explicit WakeOnce(std::function<void()> wake) : wake_{std::move(wake)} {}

  void operator()() {
    if (!woken_.exchange(true)) {
      wake_();
    }
  }
  /// To be called by work() before it looks at anything.
  void awake() { woken_ = false; }

 private:
  const std::function<void()> wake_;
  std::atomic<bool> woken_{false};
};

/// The readers that match a writer of ours. One is there when the writer reaches it.
class FoundReaders {
 public:
  /// Of on_match.
  void change(const Guid& reader, bool matched, Vendor vendor);

  [[nodiscard]] bool is_there(const Guid& reader) const;
  [[nodiscard]] bool any_there(const std::function<bool(const Guid&, Vendor)>& of_these) const;

  /// Those that the writer does not reach yet.
  [[nodiscard]] std::vector<Guid> not_reached() const;
  void is_reached(const Guid& reader);

 private:
  struct Found {
    Vendor vendor;
    bool reached;
  };
  std::map<Guid, Found> readers_;
};

/// Looks whether a writer reaches the readers that it has found; to be called by work().
/// @param mutex  of `readers`.
/// @return when to look again; nothing: it reaches all of them.
[[nodiscard]] std::optional<TimePoint> look_at(FoundReaders& readers, std::mutex& mutex, Writer& writer,
                                               TimePoint now);

/// The earlier one of those that are there.
[[nodiscard]] std::optional<TimePoint> earlier(std::optional<TimePoint> left, std::optional<TimePoint> right);

/// Counters together with those of the endpoints.
/// @param mutex  of `counters`.
template <typename Counters>
[[nodiscard]] Counters all_counters(const Counters& counters, std::mutex& mutex, const Reader& reader,
                                    const Writer& writer) {
  Counters result;
  {
    const std::lock_guard lock{mutex};
    result = counters;
  }
  result.reader = reader.counters();
  result.writer = writer.counters();
  return result;
}

}  // namespace trestle::dds::detail
