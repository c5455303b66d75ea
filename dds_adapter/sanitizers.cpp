#include <pthread.h>
#include <time.h>  // NOLINT(modernize-deprecated-headers): POSIX

#include "dds_adapter/fastdds_compat.hpp"

#ifdef __has_feature
#define TRESTLE_HAS_FEATURE(name) __has_feature(name)
#else
#define TRESTLE_HAS_FEATURE(name) 0
#endif

// What the sanitizers must know of Fast DDS.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
#if defined(__SANITIZE_ADDRESS__) || TRESTLE_HAS_FEATURE(address_sanitizer)
extern "C" const char* __asan_default_options();
/// It deletes its writers through a base class of another size.
extern "C" const char* __asan_default_options() {
  return "new_delete_type_mismatch=0";
}
#endif
#if defined(__SANITIZE_THREAD__) || TRESTLE_HAS_FEATURE(thread_sanitizer)
extern "C" const char* __tsan_default_suppressions();
/// It takes its own locks in more than one order.
extern "C" const char* __tsan_default_suppressions() {
  return "deadlock:libfastrtps.so\ndeadlock:libfastdds.so\n";
}
/// The sanitizer knows pthread_mutex_timedlock, but not this function, which std::timed_mutex uses. It would
/// believe that Fast DDS's most important locks are never taken.
extern "C" int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock, const timespec* until) {
  constexpr long second_ns = 1'000'000'000;
  timespec now{};
  timespec wall{};
  clock_gettime(clock, &now);
  clock_gettime(CLOCK_REALTIME, &wall);
  wall.tv_sec += until->tv_sec - now.tv_sec;
  wall.tv_nsec += until->tv_nsec - now.tv_nsec;
  if (wall.tv_nsec < 0) {
    wall.tv_nsec += second_ns;
    --wall.tv_sec;
  } else if (wall.tv_nsec >= second_ns) {
    wall.tv_nsec -= second_ns;
    ++wall.tv_sec;
  }
  return pthread_mutex_timedlock(mutex, &wall);
}
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
extern "C" void __sanitizer_free_hook(const volatile void* memory);
/// What was done before given_back() was done before Fast DDS frees the bytes.
extern "C" void __sanitizer_free_hook(const volatile void* memory) {
  __tsan_acquire(const_cast<void*>(memory));
}
#define TRESTLE_THREAD_SANITIZER 1
#else
#define TRESTLE_THREAD_SANITIZER 0
#endif
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace trestle::dds::fast {

void link_sanitizer_hints() noexcept {}

void given_back([[maybe_unused]] std::span<const std::byte> payload) noexcept {
#if TRESTLE_THREAD_SANITIZER
  // Before the bytes, in the same piece of memory, it keeps the count, the size and the index.
  constexpr std::size_t kept_before = 3 * sizeof(std::uint32_t);
  if (!payload.empty()) {
    __tsan_release(const_cast<std::byte*>(payload.data() - kept_before));
  }
#endif
}

}  // namespace trestle::dds::fast
