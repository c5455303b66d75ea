// What runs before main() on a bare Cortex-M3: the vector table, and the program's memory made ready. When
// main() returns, or after a fault, semihosting tells the emulator (or debugger) to end with an exit status
// that tells which.
#include "board/startup.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

// NOLINTBEGIN(bugprone-reserved-identifier): as linker scripts name them
extern "C" {
// Of mps2_an385_sections.ld: only their addresses mean something.
extern std::byte __stack_top;
extern std::byte __data_load;
extern std::byte __data_start;
extern std::byte __data_end;
extern std::byte __bss_start;
extern std::byte __bss_end;
using Constructor = void (*)();
extern Constructor __init_array_start;
extern Constructor __init_array_end;
}
// NOLINTEND(bugprone-reserved-identifier)

// The C++ standard does not allow a call of main() by its name. A main() without parameters ignores these.
int main_program(int count, const char** arguments) asm("main");

extern "C" {

[[gnu::weak]] void board_init() {}
[[gnu::weak]] void board_systick() {}

[[gnu::weak, noreturn]] void board_exit(int status) {
  // SYS_EXIT_EXTENDED: the reason ADP_Stopped_ApplicationExit, and the status.
  const std::array<std::uint32_t, 2> why{0x20026, static_cast<std::uint32_t>(status)};
  board_semihosting(0x20, why.data());
  for (;;) {
  }
}

[[noreturn]] static void fault() {
  board_semihosting(0x04, "fault: the program went astray\n");  // SYS_WRITE0
  const std::array<std::uint32_t, 2> why{0x20026, 99};
  board_semihosting(0x20, why.data());
  for (;;) {
  }
}

[[noreturn]] void reset();
[[noreturn]] void reset() {
  std::memcpy(&__data_start, &__data_load, static_cast<std::size_t>(&__data_end - &__data_start));
  std::memset(&__bss_start, 0, static_cast<std::size_t>(&__bss_end - &__bss_start));
  board_init();
  for (const Constructor* constructor = &__init_array_start; constructor != &__init_array_end;
       ++constructor) {
    (*constructor)();
  }
  std::array<const char*, 2> arguments{"program", nullptr};
  board_exit(main_program(1, arguments.data()));
}

}  // extern "C"

namespace {

using Handler = void (*)();

struct Vectors {
  const std::byte* stack_top;
  std::array<Handler, 15> system;
};

[[gnu::section(".vectors"), gnu::used]] constinit const Vectors vectors{
    &__stack_top,
    {reset, fault, fault, fault, fault, fault, nullptr, nullptr, nullptr, nullptr, fault, fault, nullptr,
     fault, board_systick}};

}  // namespace
