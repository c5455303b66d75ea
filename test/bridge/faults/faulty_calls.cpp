// Preloaded (LD_PRELOAD), it makes system calls of sockets fail and shifts the time of day, while the program
// runs: as a file says that is mapped into memory, and that a test changes (faulty_calls.py). TRESTLE_FAULTS
// is its name.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

/// What the file holds; faulty_calls.py has it once more.
struct Faults {
  std::atomic<std::int32_t> send_error;     ///< errno of calls that send; 0: they work
  std::atomic<std::uint32_t> send_every;    ///< one of so many fails
  std::atomic<std::int32_t> receive_error;  ///< the same of calls that receive
  std::atomic<std::uint32_t> receive_every;
  std::atomic<std::int64_t> shift_ns;  ///< of CLOCK_REALTIME
  std::atomic<std::int32_t> streams;   ///< whether calls of TCP sockets fail, too
  std::atomic<std::uint32_t> padding;
  std::atomic<std::uint64_t> sends;  ///< that should have worked, and have failed
  std::atomic<std::uint64_t> receives;
};

Faults* open_faults() {
  static Faults none{};
  const char* name = std::getenv("TRESTLE_FAULTS");
  const int file = name != nullptr ? open(name, O_RDWR | O_CLOEXEC) : -1;
  if (file < 0) {
    return &none;
  }
  void* memory = mmap(nullptr, sizeof(Faults), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  return memory == MAP_FAILED ? &none : static_cast<Faults*>(memory);
}

Faults& faults() {
  static Faults* const opened = open_faults();
  return *opened;
}

bool is_network(int fd) {
  int domain = 0;
  int type = 0;
  socklen_t size = sizeof domain;
  if (getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0 ||
      (domain != AF_INET && domain != AF_INET6)) {
    return false;
  }
  size = sizeof type;
  return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 &&
         (type == SOCK_DGRAM || faults().streams != 0);
}

bool fails(int fd, std::int32_t error, std::uint32_t every, std::atomic<std::uint64_t>& count) {
  if (error == 0) {
    return false;
  }
  static std::atomic<std::uint32_t> calls;
  if (!is_network(fd) || (every > 1 && ++calls % every != 0)) {
    return false;
  }
  ++count;
  errno = error;
  return true;
}

bool send_fails(int fd) {
  return fails(fd, faults().send_error, faults().send_every, faults().sends);
}
bool receive_fails(int fd) {
  return fails(fd, faults().receive_error, faults().receive_every, faults().receives);
}

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

constexpr std::int64_t second_ns = 1'000'000'000;

timespec moved(const timespec& time, std::int64_t by_ns) {
  std::int64_t seconds = time.tv_sec + by_ns / second_ns;
  std::int64_t ns = time.tv_nsec + by_ns % second_ns;
  seconds += ns < 0 ? -1 : ns >= second_ns ? 1 : 0;
  ns += ns < 0 ? second_ns : ns >= second_ns ? -second_ns : 0;
  return {seconds, ns};
}

/// Whether this is a time of day, and not one since the start of the system.
bool is_realtime(const timespec& time) {
  return time.tv_sec > second_ns;
}

}  // namespace

extern "C" {

ssize_t send(int fd, const void* data, size_t size, int flags) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t, int)>("send");
  return send_fails(fd) ? -1 : real(fd, data, size, flags);
}

ssize_t sendto(int fd, const void* data, size_t size, int flags, const sockaddr* to, socklen_t to_size) {
  static const auto real =
      next<ssize_t (*)(int, const void*, size_t, int, const sockaddr*, socklen_t)>("sendto");
  return send_fails(fd) ? -1 : real(fd, data, size, flags, to, to_size);
}

ssize_t sendmsg(int fd, const msghdr* message, int flags) {
  static const auto real = next<ssize_t (*)(int, const msghdr*, int)>("sendmsg");
  return send_fails(fd) ? -1 : real(fd, message, flags);
}

int sendmmsg(int fd, mmsghdr* messages, unsigned count, int flags) {
  static const auto real = next<int (*)(int, mmsghdr*, unsigned, int)>("sendmmsg");
  return send_fails(fd) ? -1 : real(fd, messages, count, flags);
}

ssize_t recv(int fd, void* data, size_t size, int flags) {
  static const auto real = next<ssize_t (*)(int, void*, size_t, int)>("recv");
  return receive_fails(fd) ? -1 : real(fd, data, size, flags);
}

ssize_t recvfrom(int fd, void* data, size_t size, int flags, sockaddr* from, socklen_t* from_size) {
  static const auto real = next<ssize_t (*)(int, void*, size_t, int, sockaddr*, socklen_t*)>("recvfrom");
  return receive_fails(fd) ? -1 : real(fd, data, size, flags, from, from_size);
}

ssize_t recvmsg(int fd, msghdr* message, int flags) {
  static const auto real = next<ssize_t (*)(int, msghdr*, int)>("recvmsg");
  return receive_fails(fd) ? -1 : real(fd, message, flags);
}

int recvmmsg(int fd, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
  static const auto real = next<int (*)(int, mmsghdr*, unsigned, int, timespec*)>("recvmmsg");
  return receive_fails(fd) ? -1 : real(fd, messages, count, flags, timeout);
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static const auto real = next<int (*)(clockid_t, timespec*)>("clock_gettime");
  const int result = real(clock, time);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
    *time = moved(*time, faults().shift_ns);
  }
  return result;
}

int gettimeofday(timeval* time, void* /*zone*/) noexcept {
  timespec now{};
  const int result = clock_gettime(CLOCK_REALTIME, &now);
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return result;
}

time_t time(time_t* place) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (place != nullptr) {
    *place = now.tv_sec;
  }
  return now.tv_sec;
}

// The kernel knows nothing of the shift: a time to wait for is told without it. Who waits already when the
// time is shifted waits on as long as before.

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* until) {
  if (!is_realtime(*until)) {
    return pthread_cond_clockwait(condition, mutex, CLOCK_MONOTONIC, until);
  }
  const timespec real = moved(*until, -faults().shift_ns);
  return pthread_cond_clockwait(condition, mutex, CLOCK_REALTIME, &real);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* until) noexcept {
  const timespec real = moved(*until, -faults().shift_ns);
  return pthread_mutex_clocklock(mutex, CLOCK_REALTIME, &real);
}

}  // extern "C"
