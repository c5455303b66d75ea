#include "bridge/conform/parallel.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <thread>

namespace trestle::conform {
namespace {

/// A worker gets so many cases at once: the start of a device takes as long as a case or two.
constexpr std::size_t cases_at_once = 4;

bool is_loopback(const IpAddress& address) {
  return !address.v6 && address.bytes[0] == 127;
}

}  // namespace

std::optional<Profile> beside(const Profile& profile, unsigned neighbourhood, unsigned number) {
  if (profile.lifecycle.start.empty() || !profile.lifecycle.restart.empty() || !is_loopback(profile.device) ||
      !is_loopback(profile.tester)) {
    return std::nullopt;
  }
  const auto moved = [&](IpAddress& address) {
    address.bytes[1] = static_cast<std::uint8_t>(neighbourhood);
    address.bytes[2] = static_cast<std::uint8_t>(number);
  };
  Profile other = profile;
  moved(other.device);
  moved(other.tester);
  // Multicast on loopback reaches all of it: each device needs groups that no other one listens to.
  const auto moved_group = [&](IpAddress& group) {
    group.bytes[0] = 239;
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
  RunOptions one_at_a_time = options;
  if (options.on_begin) {
    one_at_a_time.on_begin = [&](const Case& one) {
      const std::scoped_lock lock{mutex};
      options.on_begin(one);
    };
  }
  if (options.on_end) {
    one_at_a_time.on_end = [&](const CaseResult& result) {
      const std::scoped_lock lock{mutex};
      options.on_end(result);
    };
  }
  const std::size_t parts = (cases.size() + cases_at_once - 1) / cases_at_once;
  std::vector<RunResult> results(parts);
  share_work(static_cast<unsigned>(std::min(profiles.size(), parts)), parts,
             [&](unsigned worker, std::size_t part) {
               const auto from = cases.begin() + static_cast<std::ptrdiff_t>(part * cases_at_once);
               const auto to = part + 1 == parts ? cases.end() : from + cases_at_once;
               results[part] = run_cases(profiles[worker], {from, to}, one_at_a_time);
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
