#pragma once
// What startup.cpp has, and what a program may have instead. All interrupts but SysTick stay off.

extern "C" {

/// Called before the constructors of static objects. Does nothing, unless the program has one of its own: for
/// a C library that has to be made ready.
void board_init();

/// Called by the interrupt of the SysTick timer. Does nothing, unless the program has one of its own.
void board_systick();

/// Called with what main() returned. Ends the emulator, unless the program has one of its own.
[[noreturn]] void board_exit(int status);

/// Asks the emulator or debugger for `operation`, a number of Arm's semihosting. Without either it is a
/// fault.
inline int board_semihosting(int operation, const void* argument) {
  register int r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

}  // extern "C"
