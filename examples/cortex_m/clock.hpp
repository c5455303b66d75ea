#pragma once
#include <trestle/someip/wire/types.hpp>

namespace trestle::example {

/// Starts the clock, and interrupts by the processor's SysTick that end wait() each millisecond.
///
/// Those are not counted: the emulator leaves out what the host is too late for, and so would a debugger's
/// stop. Time is what the board's free-running counter says.
void start_clock() noexcept;

/// The time since start_clock(), in steps of a microsecond. To be called at least once an hour, as the
/// counter has 32 bits, and not from interrupts.
[[nodiscard]] TimePoint now() noexcept;

/// Sleeps until the next interrupt: a millisecond at most.
inline void wait() noexcept {
  asm volatile("wfi" ::: "memory");
}

}  // namespace trestle::example
