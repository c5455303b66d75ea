#include "bridge/carry/runtime/takes_at_once.hpp"

#include <poll.h>

namespace trestle::carry {

// Nobody is asked to make the descriptor non-blocking: that would also hold for all others that have it, as a
// shell.
bool takes_at_once(int fd, std::chrono::milliseconds patience) {
  pollfd asked{.fd = fd, .events = POLLOUT, .revents = 0};
  return ::poll(&asked, 1, static_cast<int>(patience.count())) != 0;
}

}  // namespace trestle::carry
