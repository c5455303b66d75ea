#include "bridge/conform/parallel.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "bridge/conform/tester.hpp"

namespace trestle::conform {
namespace {

/// A worker gets so many cases at once: the start of a device takes as long as a case or two.
constexpr std::size_t cases_at_once = 4;

bool is_loopback(const IpAddress& address) {
  return !address.v6 && address.bytes[0] == 127;
}

/// Calls `on_end` in the order of the cases, of which a few at a time are run by one thread.
class InOrder {
 public:
  InOrder(std::size_t parts, std::function<void(const CaseResult&)> on_end)
      : on_end_{std::move(on_end)}, waiting_(parts) {}

  void end_of_case(std::size_t part, const CaseResult& result) {
    const std::scoped_lock lock{mutex_};
    if (part == next_) {
      on_end_(result);
    } else {
      waiting_[part].results.push_back(result);
    }
  }
  void end_of_part(std::size_t part) {
    const std::scoped_lock lock{mutex_};
    waiting_[part].ended = true;
    while (next_ < waiting_.size() && waiting_[next_].ended) {
      if (++next_ < waiting_.size()) {
        std::ranges::for_each(std::exchange(waiting_[next_].results, {}), on_end_);
      }
    }
  }

 private:
  struct Part {
    std::vector<CaseResult> results{};
    bool ended = false;
  };

  std::function<void(const CaseResult&)> on_end_;
  std::mutex mutex_;
  std::vector<Part> waiting_;
  std::size_t next_ = 0;  ///< the part whose results are told at once
};

}  // namespace

std::optional<Profile> beside(const Profile& profile, unsigned neighbourhood, unsigned number) {
  const bool v6 = profile.device.v6;
  if (profile.lifecycle.start.empty() || !profile.lifecycle.restart.empty() ||
      (!v6 && !(is_loopback(profile.device) && is_loopback(profile.tester)))) {
    return std::nullopt;
  }
  const auto moved = [&](IpAddress& address) {
    if (v6) {
      address.bytes[13] = static_cast<std::uint8_t>(number);
    } else {
      address.bytes[1] = static_cast<std::uint8_t>(neighbourhood);
      address.bytes[2] = static_cast<std::uint8_t>(number);
    }
  };
  Profile other = profile;
  moved(other.device);
  moved(other.tester);
  if (v6 && !(Tester::is_ours(other.device) && Tester::is_ours(other.tester))) {
    return std::nullopt;
  }
  // Multicast on loopback reaches all of it: each device needs groups that no other one listens to.
  const auto moved_group = [&](IpAddress& group) {
    group.bytes[0] = v6 ? group.bytes[0] : std::uint8_t{239};
    moved(group);
  };
  moved_group(other.multicast);
  for (ServiceProfile& service : other.services) {
    for (EventgroupProfile& group : service.eventgroups) {
      if (group.multicast) {
        moved_group(group.multicast->address);
      }
    }
  }
  return other;
}

std::vector<Profile> neighbours(const Profile& profile, unsigned jobs) {
  const auto neighbourhood = 64 + static_cast<unsigned>(::getpid()) % 128;
  std::vector<Profile> all;
  for (unsigned number = 1; number <= std::min(jobs, 254U) && jobs > 1; ++number) {
    if (auto other = beside(profile, neighbourhood, number)) {
      all.push_back(*std::move(other));
    }
  }
  return all.empty() ? std::vector{profile} : all;
}

unsigned default_jobs() {
  return std::clamp(4 * std::thread::hardware_concurrency(), 4U, 16U);
}

void share_work(unsigned workers, std::size_t count,
                const std::function<void(unsigned worker, std::size_t index)>& work) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr problem;
  const auto loop = [&](unsigned worker) {
    try {
      for (std::size_t index = next++; index < count; index = next++) {
        work(worker, index);
      }
    } catch (...) {
      next = count;
      const std::scoped_lock lock{mutex};
      problem = problem ? problem : std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  for (unsigned worker = 0; worker < workers; ++worker) {
    threads.emplace_back(loop, worker);
  }
  for (std::thread& one : threads) {
    one.join();
  }
  if (problem) {
    std::rethrow_exception(problem);
  }
}

RunResult run_side_by_side(const std::vector<Profile>& profiles, const std::vector<const Case*>& cases,
                           const RunOptions& options) {
  if (profiles.size() == 1) {
    return run_cases(profiles.front(), cases, options);
  }
  const auto began = std::chrono::steady_clock::now();
  std::mutex mutex;
  const auto locked = [&mutex](const auto& callback) {
    return [&](const auto& what) {
      const std::scoped_lock lock{mutex};
      if (callback) {
        callback(what);
      }
    };
  };
  const std::size_t parts = (cases.size() + cases_at_once - 1) / cases_at_once;
  InOrder in_order{parts, locked(options.on_end)};
  // A device that is not there is not there for the others either.
  std::atomic<bool> gave_up{false};
  RunOptions one_at_a_time = options;
  one_at_a_time.on_begin = locked(options.on_begin);
  one_at_a_time.on_problem = locked(options.on_problem);
  one_at_a_time.cancelled = [&] { return gave_up || (options.cancelled && options.cancelled()); };
  std::vector<RunResult> results(parts);
  share_work(static_cast<unsigned>(std::min(profiles.size(), parts)), parts,
             [&](unsigned worker, std::size_t part) {
               if (one_at_a_time.cancelled()) {
                 results[part].cancelled = true;
                 return;
               }
               const auto from = cases.begin() + static_cast<std::ptrdiff_t>(part * cases_at_once);
               const auto to = part + 1 == parts ? cases.end() : from + cases_at_once;
               RunOptions how = one_at_a_time;
               how.on_end = [&](const CaseResult& result) { in_order.end_of_case(part, result); };
               results[part] = run_cases(profiles[worker], {from, to}, how);
               gave_up = gave_up || !results[part].gave_up.empty();
               in_order.end_of_part(part);
             });
  RunResult whole;
  for (RunResult& part : results) {
    whole.started = whole.started.empty() ? part.started : whole.started;
    whole.cancelled = whole.cancelled || part.cancelled;
    whole.gave_up = whole.gave_up.empty() ? part.gave_up : whole.gave_up;
    std::ranges::move(part.cases, std::back_inserter(whole.cases));
  }
  whole.took =
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - began);
  return whole;
}

}  // namespace trestle::conform
