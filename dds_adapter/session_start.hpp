#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>

#include "dds_adapter/fastdds_compat.hpp"

namespace trestle::dds::fast {

/// Makes sure that a writer's new reader receives all that is written from a moment on.
///
/// RTPS does not say with which sample a volatile reader begins. Cyclone DDS's begin after the newest one
/// that the first heartbeat tells of. So a sample is lost, and acknowledged all the same, when that heartbeat
/// overtakes it, or when it is written before the reader's side has found the writer. And Fast DDS sends
/// heartbeats as long as a sample is not acknowledged, but none before there is a sample. So a sample is
/// written that is relevant to nobody, which no reader gets, and as soon as the reader has acknowledged it
/// the beginning is behind.
///
/// Where Fast DDS gives no way to do so, time has to do: it is enough for readers that were there before the
/// writer, as the heartbeat with which Fast DDS greets them finds them ready. Others may still lose the first
/// samples (docs/dds.md).
class SessionStart {
 public:
  /// @param writer  is deleted before this.
  explicit SessionStart(const DataWriter& writer) : hidden_{writer} {}

  /// False also when there is no such reader.
  /// @param write  writes a sample that belongs to one of the same writer's, which no other does, and tells
  ///               its number, 0 when it could not.
  template <typename Write>
  bool reaches(const Guid& reader, const Write& write) {
    if constexpr (!HiddenSamples::are_possible) {
      return has_settled(reader);
    }
    const ReaderProgress progress = hidden_.progress_of(reader);
    if (progress.acknowledges_nothing) {
      return true;
    }
    if (const std::uint64_t began = began_with(reader); began != 0) {
      return progress.acknowledged >= began;
    }
    if (const std::uint64_t number = progress.is_there ? write() : 0; number != 0) {
      const std::lock_guard lock{mutex_};
      began_.emplace(reader, number);
    }
    return false;
  }

  void forget(const Guid& reader) {
    const std::lock_guard lock{mutex_};
    began_.erase(reader);
    first_asked_.erase(reader);
  }

 private:
  [[nodiscard]] std::uint64_t began_with(const Guid& reader) const {
    const std::lock_guard lock{mutex_};
    const auto began = began_.find(reader);
    return began == began_.end() ? 0 : began->second;
  }

  /// Since the first question, which comes as soon as the writer has found the reader.
  bool has_settled(const Guid& reader) {
    constexpr std::chrono::milliseconds settling_time{200};
    constexpr std::size_t max_readers = 4096;  // a question may come after the reader has been forgotten
    const auto now = std::chrono::steady_clock::now();
    const std::lock_guard lock{mutex_};
    if (first_asked_.size() >= max_readers) {
      first_asked_.clear();  // they wait anew
    }
    return now - first_asked_.try_emplace(reader, now).first->second >= settling_time;
  }

  HiddenSamples hidden_;
  mutable std::mutex mutex_;
  std::map<Guid, std::uint64_t> began_;
  std::map<Guid, std::chrono::steady_clock::time_point> first_asked_;
};

}  // namespace trestle::dds::fast
