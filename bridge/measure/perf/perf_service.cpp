#include "bridge/measure/perf/perf_service.hpp"

#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "bridge/measure/report.hpp"

namespace trestle::measure::perf {
namespace {

constexpr std::int64_t second_us = 1'000'000;

std::uint64_t ns_of(const timeval& time) {
  return static_cast<std::uint64_t>((time.tv_sec * second_us + time.tv_usec) * 1000);
}

/// The boot of the host, and the time namespace that shifts its clock.
std::uint64_t name_of_clock() {
  std::string boot;
  std::ifstream{"/proc/sys/kernel/random/boot_id"} >> boot;
  std::error_code none;
  const auto space = std::filesystem::read_symlink("/proc/self/ns/time", none);
  return std::hash<std::string>{}(boot + space.string());
}

}  // namespace

someip::TpPacing pacing_of(const EventPlan& plan) {
  return {.burst = plan.burst > 0 ? std::optional<std::size_t>{plan.burst} : std::nullopt,
          .separation = std::chrono::nanoseconds{plan.separation_ns}};
}

Status own_status() {
  static const std::uint64_t clock = name_of_clock();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return {.now_ns = static_cast<std::uint64_t>(monotonic_ns()),
          .clock = clock,
          .user_ns = ns_of(usage.ru_utime),
          .system_ns = ns_of(usage.ru_stime)};
}

CpuTime cpu_between(const Status& before, const Status& after) {
  const auto elapsed = static_cast<double>(after.now_ns - before.now_ns);
  const auto percent = [elapsed](std::uint64_t from, std::uint64_t to) {
    return elapsed > 0 ? 100 * static_cast<double>(to - from) / elapsed : 0;
  };
  return {percent(before.user_ns, after.user_ns), percent(before.system_ns, after.system_ns)};
}

}  // namespace trestle::measure::perf
