#include "sd/net/busy_run.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <vector>

namespace trestle::test::busy_run_test {
namespace {

using namespace std::chrono_literals;

// How often this thread has gone to sleep.
long sleeps() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

// The times that it goes to sleep until a timer is due.
long sleeps_until_timer(Duration busy) {
  boost::asio::io_context io{1};
  boost::asio::steady_timer timer{io, 20ms};
  bool due = false;
  timer.async_wait([&](const boost::system::error_code& error) { due = !error; });
  const long before = sleeps();
  sd::run_busy(io, busy);
  EXPECT_TRUE(due);
  return sleeps() - before;
}

// Once, as the system may have put it to sleep, who fetches a page of memory or stops a process.
template <typename Sleeps>
bool does_not_sleep(Sleeps sleeps_of_a_try) {
  for (int tries = 0; tries < 10; ++tries) {
    if (sleeps_of_a_try() == 0) {
      return true;
    }
  }
  return false;
}

TEST(RunBusyTest, DoesNotSleepBeforeItsTimeIsOver) {
  EXPECT_TRUE(does_not_sleep([] { return sleeps_until_timer(10s); }));
}

// Unless the machine has stalled until the timer was due.
bool sleeps_until_a_timer(Duration busy) {
  for (int tries = 0; tries < 100; ++tries) {
    if (sleeps_until_timer(busy) >= 1) {
      return true;
    }
  }
  return false;
}

TEST(RunBusyTest, SleepsAtOnceWithoutTime) {
  EXPECT_TRUE(sleeps_until_a_timer(0s));
}

TEST(RunBusyTest, SleepsWhenItsTimeIsOver) {
  EXPECT_TRUE(sleeps_until_a_timer(1ms));
}

TEST(RunBusyTest, EndsWithoutWorkAndWhenStopped) {
  for (const Duration busy : {Duration{0}, Duration{10s}}) {
    boost::asio::io_context io{1};
    sd::run_busy(io, busy);  // no work

    io.restart();
    std::vector<int> done;
    boost::asio::steady_timer never{io, 1h};
    never.async_wait([&](const boost::system::error_code&) { done.push_back(3); });
    boost::asio::post(io, [&] { done.push_back(1); });
    boost::asio::post(io, [&] {
      done.push_back(2);
      io.stop();
    });
    sd::run_busy(io, busy);
    EXPECT_EQ(done, (std::vector{1, 2}));
  }
}

// As a reload of the configuration does.
long sleeps_after_a_change() {
  boost::asio::io_context io{1};
  Duration busy{0};
  boost::asio::steady_timer timer{io, 1ms};
  long before = 0;
  timer.async_wait([&](const boost::system::error_code&) {
    busy = 10s;
    before = sleeps();
    timer.expires_after(10ms);
    timer.async_wait([](const boost::system::error_code&) {});
  });
  sd::run_busy(io, busy);
  return sleeps() - before;
}

TEST(RunBusyTest, TakesAChangeOfItsTime) {
  EXPECT_TRUE(does_not_sleep(sleeps_after_a_change));
}

}  // namespace
}  // namespace trestle::test::busy_run_test
