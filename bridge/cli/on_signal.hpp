#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>
#include <initializer_list>
#include <utility>

#include "bridge/cli/signals.hpp"

namespace trestle::cli {

/// Calls `handler(number)` from an io_context for each signal that comes.
///
/// In place of boost::asio::signal_set, whose handler may run in any thread: under the thread sanitizer,
/// which puts handlers off, signals got lost.
class OnSignal {
 public:
  OnSignal(boost::asio::io_context& io, std::initializer_list<int> numbers, std::function<void(int)> handler)
      : signals_{numbers}, readable_{io, signals_.fd()}, handler_{std::move(handler)} {
    wait();
  }
  ~OnSignal() { readable_.release(); }  // the file descriptor is that of `signals_`
  OnSignal(const OnSignal&) = delete;
  OnSignal& operator=(const OnSignal&) = delete;

 private:
  void wait() {
    readable_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                         [this](const boost::system::error_code& error) {
                           if (error) {
                             return;
                           }
                           wait();
                           if (const auto number = signals_.next()) {
                             handler_(*number);
                           }
                         });
  }

  Signals signals_;
  boost::asio::posix::stream_descriptor readable_;
  std::function<void(int)> handler_;
};

}  // namespace trestle::cli
