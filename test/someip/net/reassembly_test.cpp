// The memory of large messages: what the system gives, and gets back.
#include "someip/net/reassembly.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "test/sanitized.hpp"

namespace trestle::someip::reassembly_test {
namespace {
using namespace std::chrono_literals;

constexpr TimePoint start{1000s};
constexpr std::size_t message_bytes = std::size_t{1} << 20U;
constexpr std::size_t slice_bytes = 32768;
constexpr TpReassemblyLimits limits{.max_message_bytes = message_bytes, .max_per_sender = 4, .max_age = 5s};

Endpoint host(std::size_t number) {
  return {IpAddress::v4(10, 0, 0, static_cast<std::uint8_t>(number)), 30501};
}

/// Of the whole process: in memory, and addresses.
struct Pages {
  std::size_t addresses = 0;
  std::size_t resident = 0;
};
Pages pages() {
  Pages result;
  std::ifstream{"/proc/self/statm"} >> result.addresses >> result.resident;
  return result;
}
std::size_t resident_bytes() {
  return pages().resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

/// Offers the segments in [from, to) of a message of message_bytes; whether it became whole.
bool offer(Reassembly& reassembly, const Endpoint& sender, std::uint16_t session, std::size_t from,
           std::size_t to, TimePoint now) {
  const Header header{.session = SessionId{session}, .type = MessageType::tp_notification};
  std::vector<std::byte> payload(4 + slice_bytes, std::byte{0x5a});
  bool whole = false;
  for (std::size_t offset = from; offset < to; offset += slice_bytes) {
    const std::size_t word = offset | (offset + slice_bytes < message_bytes ? 1U : 0U);
    for (std::size_t i = 0; i < 4; ++i) {
      payload[i] = static_cast<std::byte>(word >> (24 - 8 * i));
    }
    const auto outcome = reassembly.on_segment(sender, {header, payload}, now);
    whole = outcome && *outcome;
  }
  return whole;
}

TEST(Reassembly, GivesTheMemoryOfMessagesThatNeverBecameWholeBack) {
  Reassembly reassembly{16, limits};
  EXPECT_TRUE(offer(reassembly, host(0), 1, 0, message_bytes, start));
  const std::size_t before = resident_bytes();
  for (std::size_t i = 1; i <= 40; ++i) {
    EXPECT_FALSE(offer(reassembly, host(i), 1, 0, message_bytes - slice_bytes, start + i * 1ms));
  }
  EXPECT_EQ(reassembly.places(), 16U);
  EXPECT_GT(resident_bytes(), before + 12 * message_bytes);
  TimePoint now = start;
  while (const auto due = reassembly.deadline()) {
    ASSERT_GT(*due, now);
    now = *due;
    reassembly.on_time(now);
  }
  EXPECT_LE(now, start + 11s) << "max_age, and as long again";
  EXPECT_EQ(reassembly.places(), 1U);
  EXPECT_LT(resident_bytes(), before + (test::sanitized ? 8 : 1) * message_bytes / 2);
  EXPECT_TRUE(offer(reassembly, host(0), 2, 0, message_bytes, now));
}

// A host that was started anew counts its sessions from 1 on, as before.
TEST(Reassembly, TakesNothingOfBeforeForAMessageOfAHostThatWasStartedAnew) {
  Reassembly reassembly{16, limits};
  EXPECT_FALSE(offer(reassembly, host(0), 1, 0, message_bytes / 2, start));
  EXPECT_FALSE(offer(reassembly, host(1), 1, 0, message_bytes / 2, start));
  reassembly.forget(host(0).address, start);
  EXPECT_EQ(reassembly.counters()[TpDrop::replaced], 1U);
  EXPECT_FALSE(offer(reassembly, host(0), 1, message_bytes / 2, message_bytes, start));
  EXPECT_TRUE(offer(reassembly, host(0), 1, 0, message_bytes / 2, start));
  EXPECT_EQ(reassembly.counters()[TpDrop::overlap], 0U);
  EXPECT_TRUE(offer(reassembly, host(1), 1, message_bytes / 2, message_bytes, start))
      << "another host's stays";
  // Nor is a message that was complete: the same session is that of another one.
  reassembly.forget(host(0).address, start);
  EXPECT_TRUE(offer(reassembly, host(0), 1, 0, message_bytes, start));
  EXPECT_EQ(reassembly.counters()[TpDrop::stale], 0U);
}

TEST(Reassembly, KeepsTheMemoryOfMessagesThatComeSteadily) {
  const auto faults = [] {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_minflt;
  };
  Reassembly reassembly{16, limits};
  TimePoint now = start;
  std::uint16_t session = 0;
  const auto one = [&] {
    EXPECT_TRUE(offer(reassembly, host(1), ++session, 0, message_bytes, now));
    now += 4s;
    reassembly.on_time(now);
  };
  one();
  const auto before = faults();
  for (int i = 0; i < 16; ++i) {
    one();
  }
  EXPECT_LT(faults() - before, test::sanitized ? 512 : 128) << "one message fills 256 pages";
}

// Two ports, and memory for four messages.
class BudgetOfReassembliesTest : public testing::Test {
 protected:
  static constexpr std::size_t budget_bytes = 4 * message_bytes;

  std::shared_ptr<ReassemblyBudget> budget = std::make_shared<ReassemblyBudget>(budget_bytes);
  Reassembly here{64, limits, budget};
  Reassembly there{64, limits, budget};
};

TEST_F(BudgetOfReassembliesTest, CountsWhatIsFilledAndNoMore) {
  EXPECT_FALSE(offer(here, host(1), 1, 0, slice_bytes, start));
  EXPECT_EQ(budget->used_bytes(), std::size_t{64} << 10U);
  EXPECT_FALSE(offer(there, host(1), 1, message_bytes / 2, message_bytes / 2 + slice_bytes, start));
  EXPECT_EQ(budget->used_bytes(), std::size_t{128} << 10U);
  EXPECT_TRUE(offer(here, host(1), 1, slice_bytes, message_bytes, start));
  EXPECT_EQ(budget->used_bytes(), message_bytes + (std::size_t{64} << 10U));
  here.on_time(start + 20s);
  there.on_time(start + 5s);
  there.on_time(start + 20s);
  EXPECT_EQ(budget->used_bytes(), 0U);
  {
    Reassembly other{4, limits, budget};
    EXPECT_FALSE(offer(other, host(1), 1, 0, slice_bytes, start + 20s));
    EXPECT_NE(budget->used_bytes(), 0U);
  }
  EXPECT_EQ(budget->used_bytes(), 0U);
}

TEST_F(BudgetOfReassembliesTest, TakesTheSlowestAtAnyPortForWhatComesFaster) {
  const std::size_t before = resident_bytes();
  // Each has half a megabyte and 5 s of patience: 20 MB without a limit.
  TimePoint now = start;
  for (std::size_t i = 1; i <= 40; ++i) {
    EXPECT_FALSE(offer(i % 2 == 0 ? here : there, host(i), 1, 0, message_bytes / 2, now));
    now += 100ms;
    ASSERT_LE(budget->used_bytes(), budget_bytes);
  }
  if (!test::sanitized) {  // which has memory of its own for each page that was touched
    EXPECT_LT(resident_bytes(), before + budget_bytes + message_bytes);
  }
  EXPECT_EQ(here.counters()[TpDrop::no_memory] + there.counters()[TpDrop::no_memory], 32U);
  EXPECT_TRUE(offer(here, host(50), 1, 0, message_bytes, now)) << "who is honest comes through";
  EXPECT_EQ(here.counters()[TpDrop::no_memory] + there.counters()[TpDrop::no_memory], 34U);
  EXPECT_FALSE(offer(here, host(2), 1, message_bytes / 2, message_bytes, now))
      << "the rest of one that gave way";
  EXPECT_GT(here.counters()[TpDrop::stale], 0U);
}

TEST_F(BudgetOfReassembliesTest, GivesBackFirstWhatIsOnlyKept) {
  for (std::size_t i = 1; i <= 20; ++i) {
    EXPECT_TRUE(offer(i % 2 == 0 ? here : there, host(i), 1, 0, message_bytes, start + i * 1ms));
    EXPECT_LE(budget->used_bytes(), budget_bytes);
  }
  EXPECT_EQ(here.counters()[TpDrop::no_memory] + there.counters()[TpDrop::no_memory], 0U);
}

TEST_F(BudgetOfReassembliesTest, RefusesTheNextWhereAllAreFast) {
  for (std::size_t i = 1; i <= 4; ++i) {
    EXPECT_FALSE(offer(here, host(i), 1, 0, message_bytes - slice_bytes, start));
  }
  EXPECT_FALSE(offer(there, host(5), 1, 0, slice_bytes, start));
  EXPECT_EQ(there.counters()[TpDrop::no_memory], 1U);
  EXPECT_TRUE(offer(here, host(1), 1, message_bytes - slice_bytes, message_bytes, start));
  EXPECT_TRUE(offer(there, host(5), 2, 0, message_bytes, start + 1ms)) << "in place of the one that is whole";
}

TEST(Reassembly, TakesNoPlaceForAMessageLargerThanItCanBe) {
  Reassembly reassembly{4, limits};
  const Header header{.session = SessionId{1}, .type = MessageType::tp_request};
  std::vector<std::byte> payload(4 + 2000);
  payload[3] = std::byte{1};
  EXPECT_EQ(reassembly.on_segment(host(1), {header, payload}, start, 1999),
            tl::unexpected{TpDrop::too_large});
  EXPECT_EQ(reassembly.places(), 0U);
  EXPECT_EQ(reassembly.counters()[TpDrop::too_large], 1U);
  EXPECT_TRUE(reassembly.on_segment(host(1), {header, payload}, start, 2000));
}

TEST(Reassembly, GoesOnWithWhatTheSystemHasMemoryFor) {
  if (test::sanitized) {
    GTEST_SKIP() << "a sanitizer does not run with little memory";
  }
  const auto with_little_memory = [] {
    Reassembly reassembly{16, limits};
    offer(reassembly, host(0), 1, 0, slice_bytes, start);
    const std::size_t room =
        pages().addresses * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + 3 * message_bytes;
    const rlimit little{room, room};
    if (::setrlimit(RLIMIT_AS, &little) != 0) {
      std::exit(1);
    }
    for (std::size_t i = 1; i < 10; ++i) {  // more than there is memory for
      offer(reassembly, host(i), 1, 0, slice_bytes, start + 1ms * i);
    }
    const bool whole = offer(reassembly, host(1), 2, 0, message_bytes, start + 1s);
    std::exit(whole && reassembly.places() < 10 ? 0 : 2);
  };
  EXPECT_EXIT(with_little_memory(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace trestle::someip::reassembly_test
