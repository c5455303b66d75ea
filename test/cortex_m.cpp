// The C library of a test program on a board without operating system: newlib, which reads and writes by
// semihosting.
#include <sys/stat.h>

#include <cerrno>
#include <cstdlib>

#include "examples/cortex_m/board/startup.hpp"

extern "C" {

void initialise_monitor_handles();  // newlib's: opens standard input and output

void board_init() {
  initialise_monitor_handles();
}

void board_exit(int status) {
  std::exit(status);
}

void* __dso_handle =
    nullptr;  // NOLINT(bugprone-reserved-identifier): whom destructors are of: the one program
int mkdir(const char* /*path*/, mode_t /*mode*/) {  // GoogleTest's, for reports that nobody asks for here
  errno = ENOSYS;
  return -1;
}
void _init() {}  // NOLINT(bugprone-reserved-identifier): newlib calls them before and after all others
void _fini() {}  // NOLINT(bugprone-reserved-identifier)

}  // extern "C"
