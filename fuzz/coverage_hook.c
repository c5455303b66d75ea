/* Tells `trestle fuzz` which code of a device is run. Compile the device with
 *   clang -fsanitize-coverage=trace-pc-guard
 * and link this file, which is compiled without that. The environment variable TRESTLE_COVERAGE, which
 * `trestle fuzz` sets for the device that it starts, names the file of 65,536 bytes that both map. Without it
 * nothing happens.
 */
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

enum { map_size = 65536 };

static uint8_t unused[map_size];
static uint8_t* map = unused;

static void attach(void) {
  const char* name = getenv("TRESTLE_COVERAGE");
  const int file = name == NULL ? -1 : open(name, O_RDWR | O_CLOEXEC);
  if (file >= 0) {
    void* shared = mmap(NULL, map_size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (shared != MAP_FAILED) {
      map = shared;
    }
    close(file);
  }
}

void __sanitizer_cov_trace_pc_guard_init(uint32_t* begin, uint32_t* end) {
  static uint32_t places;
  if (begin == end || *begin != 0) {
    return;
  }
  if (places == 0) {
    attach();
  }
  for (uint32_t* one = begin; one < end; ++one) {
    *one = ++places % map_size; /* 0 stands for places that are not counted */
  }
}

void __sanitizer_cov_trace_pc_guard(uint32_t* place) {
  map[*place] = 1;
}
