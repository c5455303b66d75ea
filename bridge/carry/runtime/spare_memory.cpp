#include "bridge/carry/runtime/spare_memory.hpp"

#include <unistd.h>

#include <cstdio>
#include <memory>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace trestle::carry {
namespace {

#ifdef __GLIBC__
// Bytes of the process that are no file's and that nobody has allocated.
std::size_t unused_bytes() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> statm{std::fopen("/proc/self/statm", "re"),
                                                              &std::fclose};
  unsigned long size = 0;
  unsigned long resident = 0;
  unsigned long of_files = 0;
  if (!statm || std::fscanf(statm.get(), "%lu %lu %lu", &size, &resident, &of_files) != 3) {
    return 0;
  }
  const std::size_t own = (resident - of_files) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const struct mallinfo2 allocated = mallinfo2();
  const std::size_t used = allocated.uordblks + allocated.hblkhd;
  return own > used ? own - used : 0;
}
#endif

}  // namespace

SpareMemory::SpareMemory(boost::asio::io_context& io) : timer_{io} {
#ifdef __GLIBC__
  mallopt(M_ARENA_MAX, most_arenas);
  mallopt(M_MMAP_THRESHOLD, most_kept);
  mallopt(M_TRIM_THRESHOLD, most_kept);
#endif
  wait();
}

void SpareMemory::wait() {
  timer_.expires_after(std::chrono::seconds{1});
  timer_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled) {
      look();
      wait();
    }
  });
}

void SpareMemory::look() {
#ifdef __GLIBC__
  if (rule_.is_due(unused_bytes())) {
    malloc_trim(0);
    rule_.given_back(unused_bytes());
  }
#endif
}

}  // namespace trestle::carry
