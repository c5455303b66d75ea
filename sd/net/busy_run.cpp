#include "sd/net/busy_run.hpp"

#include "sd/net/clock.hpp"

namespace trestle::sd {

void run_busy(boost::asio::io_context& io, const Duration& busy) {
  while (!io.stopped()) {
    bool worked = false;
    if (busy > Duration::zero()) {
      const TimePoint begin = now();
      do {
        worked = io.poll() > 0;
      } while (!worked && !io.stopped() && now() - begin < busy);
    }
    if (!worked) {
      io.run_one();
    }
  }
}

}  // namespace trestle::sd
