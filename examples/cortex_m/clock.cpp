#include "clock.hpp"

namespace trestle::example {
namespace {

constexpr std::uint32_t clock_mhz = 25;  // of the processor, and of the counter before its prescaler

volatile std::uint32_t& at(std::uintptr_t address) noexcept {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): registers stand where the hardware has them
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}

// SysTick.  [Armv7-M Architecture Reference Manual B3.3]
constexpr std::uintptr_t systick_control = 0xe000'e010;
constexpr std::uintptr_t systick_reload = 0xe000'e014;
constexpr std::uintptr_t systick_current = 0xe000'e018;
// The counter among the board's system registers.  [Application Note AN385, FPGAIO]
constexpr std::uintptr_t counter = 0x4002'8018;
constexpr std::uintptr_t counter_prescale = 0x4002'801c;

std::uint32_t last_count = 0;
std::chrono::microseconds elapsed{0};

}  // namespace

void start_clock() noexcept {
  at(counter_prescale) = clock_mhz - 1;
  last_count = at(counter);
  at(systick_reload) = clock_mhz * 1000 - 1;
  at(systick_current) = 0;
  at(systick_control) = 7;  // on, with interrupt, at the processor's clock
}

TimePoint now() noexcept {
  const std::uint32_t count = at(counter);
  elapsed += std::chrono::microseconds{count - last_count};  // also when it has wrapped around
  last_count = count;
  return TimePoint{elapsed};
}

}  // namespace trestle::example
