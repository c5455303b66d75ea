#include "dds_adapter/sending_thread.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>

#include "test/dds_adapter/dds_test.hpp"

namespace trestle::dds::detail::sending_thread_test {
namespace {

using namespace std::chrono_literals;
using test::Inbox;
using test::make_sample;
using test::patience;
using testing::ElementsAre;
using testing::ElementsAreArray;
using Bytes = std::vector<std::byte>;

/// In the place of DDS: copies each sample, then takes as long to send it as the test says.
class Dds {
 public:
  void send(RawSample& sample) {
    Bytes bytes;
    for (const ByteView slice : sample.slices) {
      bytes.insert(bytes.end(), slice.begin(), slice.end());
    }
    sample.loan->slices_copied();
    {
      std::unique_lock lock{mutex_};
      changed_.wait_for(lock, 2 * patience, [&] { return goes_on_; });  // so that a failed test can end
    }
    sent_.put(std::move(bytes));
  }

  void hold() { set(false); }
  void go_on() { set(true); }
  [[nodiscard]] std::vector<Bytes> sent() { return sent_.take(); }

 private:
  void set(bool goes_on) {
    const std::lock_guard lock{mutex_};
    goes_on_ = goes_on;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool goes_on_ = true;
  Inbox<Bytes> sent_;
};

class SendingThreads : public testing::Test {
 protected:
  ~SendingThreads() override { dds.go_on(); }

  /// In two slices, whose memory is overwritten as soon as they are free.
  void give(std::uint32_t seed) {
    Bytes bytes = make_sample(1000, seed);
    const std::array slices{ByteView{bytes}.first(10), ByteView{bytes}.subspan(10)};
    RawSample sample;
    sample.slices = slices;
    sample.size = bytes.size();
    thread.give(sample);
    std::ranges::fill(bytes, std::byte{0xee});
  }

  Dds dds;
  SendingThread thread{[this](RawSample& sample) { dds.send(sample); }};
};

TEST_F(SendingThreads, SendWhatTheyAreGivenInItsOrder) {
  std::vector<Bytes> expected;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    give(seed);
    expected.push_back(make_sample(1000, seed));
  }
  EXPECT_TRUE(thread.wait_until_idle(patience));
  EXPECT_THAT(dds.sent(), ElementsAreArray(expected));
}

TEST_F(SendingThreads, SendWhatSeveralGive) {
  std::vector<std::thread> givers;
  for (std::uint32_t giver = 0; giver < 3; ++giver) {
    givers.emplace_back([this, giver] {
      for (std::uint32_t i = 0; i < 50; ++i) {
        give(giver * 50 + i);
      }
    });
  }
  for (std::thread& giver : givers) {
    giver.join();
  }
  EXPECT_TRUE(thread.wait_until_idle(patience));
  std::vector<Bytes> expected;
  for (std::uint32_t seed = 0; seed < 150; ++seed) {
    expected.push_back(make_sample(1000, seed));
  }
  EXPECT_THAT(dds.sent(), testing::UnorderedElementsAreArray(expected));
}

TEST_F(SendingThreads, KeepNobodyUntilASampleHasBeenSent) {
  dds.hold();
  give(1);  // it comes back
  EXPECT_FALSE(thread.wait_until_idle(0ns));
  EXPECT_THAT(dds.sent(), testing::IsEmpty());
  dds.go_on();
  EXPECT_TRUE(thread.wait_until_idle(patience));
  EXPECT_THAT(dds.sent(), ElementsAre(make_sample(1000, 1)));
}

TEST_F(SendingThreads, FinishWhatIsBeingSentWhenTheyStop) {
  dds.hold();
  give(1);
  std::thread stopper{[&] { thread.stop(); }};
  dds.go_on();
  stopper.join();
  EXPECT_THAT(dds.sent(), ElementsAre(make_sample(1000, 1)));
}

TEST(SendingThread, OfWhichNothingIsWantedIsNone) {
  SendingThread thread{[](RawSample&) { FAIL(); }};
  EXPECT_TRUE(thread.wait_until_idle(0ns));
}

TEST(SendingThread, FreesTheSlicesOfWhatDdsRefuses) {
  SendingThread thread{[](RawSample&) {}};
  const Bytes bytes = make_sample(100, 1);
  const ByteView slice{bytes};
  RawSample sample;
  sample.slices = {&slice, 1};
  sample.size = bytes.size();
  thread.give(sample);
  EXPECT_TRUE(thread.wait_until_idle(patience));
}

}  // namespace
}  // namespace trestle::dds::detail::sending_thread_test
