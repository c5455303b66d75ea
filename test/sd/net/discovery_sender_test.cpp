// What the system does not take of discovery is sent again: in order, for a while, and as much as may wait.
#include "sd/net/discovery_sender.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cerrno>
#include <functional>
#include <set>
#include <string>
#include <vector>

namespace trestle::sd::discovery_sender_test {
namespace {

using namespace std::chrono_literals;
using someip::SendStatus;
using testing::ElementsAre;
using testing::IsEmpty;

const TimePoint start{1h};
const Endpoint group{IpAddress::v4(224, 244, 224, 245), 30490};

Endpoint host(std::uint8_t number) {
  return {IpAddress::v4(192, 0, 2, number), 30490};
}

// A system with two send buffers and a table of neighbours.
class DiscoverySenderTest : public testing::Test {
 protected:
  SendStatus take(int error, const std::string& name, ByteView bytes) {
    if (error == 0) {
      sent.push_back(name + std::to_string(std::to_integer<int>(bytes[0])));
      return SendStatus::sent;
    }
    errno = error;
    return error == EAGAIN || error == ENOBUFS ? SendStatus::would_block : SendStatus::failed;
  }
  int send(const Endpoint& to, int number) {
    const std::array bytes{std::byte(number)};
    return sender.send(to, bytes, now);
  }
  void pass(Duration time) {
    now += time;
    sender.on_time(now);
  }

  TimePoint now = start;
  int single_error = 0;
  int group_error = 0;
  std::set<IpAddress> known;
  std::set<IpAddress> no_place;      ///< in the table of neighbours
  std::function<bool()> gave_place;  ///< asked for those
  std::vector<std::string> sent;
  NodeCounters counters;
  DiscoverySender sender{{.single =
                              [this](const Endpoint& to, ByteView bytes) {
                                const bool none =
                                    no_place.contains(to.address) && !(gave_place && gave_place());
                                return take(none ? ENOBUFS : single_error, "single ", bytes);
                              },
                          .group =
                              [this](const Endpoint&, ByteView bytes, bool heard_here) {
                                return take(group_error, heard_here ? "group again " : "group ", bytes);
                              },
                          .known = [this](const IpAddress& one) { return known.contains(one); }},
                         4,
                         counters};
};

TEST_F(DiscoverySenderTest, SendsAgainWhatTheSystemDidNotTake) {
  group_error = EAGAIN;
  single_error = EAGAIN;
  EXPECT_EQ(send(group, 1), 0);
  EXPECT_EQ(send(host(1), 2), 0);
  EXPECT_EQ(sender.deadline(), now + DiscoverySender::retry_min);
  pass(DiscoverySender::retry_min);
  EXPECT_THAT(sent, IsEmpty());
  EXPECT_EQ(sender.deadline(), now + 2 * DiscoverySender::retry_min) << "slower and slower";
  group_error = single_error = 0;
  pass(DiscoverySender::retry_max);
  EXPECT_THAT(sent, ElementsAre("group 1", "single 2"));
  EXPECT_EQ(sender.deadline(), std::nullopt);
  EXPECT_EQ(counters.discovery_waited, 2U);
  EXPECT_EQ(counters.discovery_not_sent + counters.discovery_no_room + counters.discovery_outdated, 0U);
}

TEST_F(DiscoverySenderTest, KeepsTheOrderOfWhatIsForOneReceiver) {
  no_place.insert(host(1).address);
  send(host(1), 1);
  send(host(2), 2);
  no_place.clear();
  send(host(1), 3);
  EXPECT_THAT(sent, ElementsAre("single 2")) << "the later one does not overtake";
  pass(DiscoverySender::retry_unknown);
  EXPECT_THAT(sent, ElementsAre("single 2", "single 1", "single 3"));
}

TEST_F(DiscoverySenderTest, TriesNoLaterOneWhenAnEarlierOneWasNotTaken) {
  no_place.insert(host(1).address);
  send(host(1), 1);
  send(host(1), 2);
  send(host(3), 3);
  int tries = 0;
  gave_place = [&] { return ++tries > 1; };  // for the second one, as somebody else has just ended
  pass(DiscoverySender::retry_unknown);
  EXPECT_EQ(tries, 1);
  EXPECT_THAT(sent, ElementsAre("single 3"));
}

TEST_F(DiscoverySenderTest, HasABufferForTheGroupThatSilentHostsCannotFill) {
  single_error = EAGAIN;  // full of what is for hosts that do not answer
  send(host(1), 1);
  send(group, 2);
  EXPECT_THAT(sent, ElementsAre("group 2"));
  known.insert(host(2).address);
  send(host(2), 3);
  EXPECT_THAT(sent, ElementsAre("group 2", "group 3")) << "who is known to be there has it, too";
  known.insert(host(1).address);
  pass(DiscoverySender::retry_unknown);
  EXPECT_THAT(sent, ElementsAre("group 2", "group 3", "group 1")) << "as soon as he is known";
}

TEST_F(DiscoverySenderTest, TakesAFullTableOfNeighboursForSomethingThatPasses) {
  group_error = ENOBUFS;
  EXPECT_EQ(send(group, 1), 0);
  no_place.insert(host(1).address);
  EXPECT_EQ(send(host(1), 2), 0);
  EXPECT_EQ(send(host(2), 3), 0);
  EXPECT_THAT(sent, ElementsAre("single 3")) << "who has a place in it needs not wait";
  no_place.clear();
  group_error = 0;
  pass(DiscoverySender::retry_min);
  EXPECT_THAT(sent, ElementsAre("single 3", "group again 1", "single 2")) << "this host has heard the first";

  const Endpoint sixth{{.bytes = {0xfd}, .v6 = true}, 30490};
  single_error = EINVAL;  // how it shows over IPv6
  EXPECT_EQ(send(sixth, 4), 0);
  single_error = 0;
  pass(DiscoverySender::retry_unknown);
  EXPECT_EQ(sent.back(), "single 4");
  EXPECT_EQ(counters.discovery_not_sent, 0U);
}

// Those who send messages need places in the table, too.
TEST_F(DiscoverySenderTest, AsksForAPlaceInTheTableOfNeighboursOnceInARound) {
  int tries = 0;
  gave_place = [&] {
    ++tries;
    return false;
  };
  for (std::uint8_t i = 1; i <= 3; ++i) {
    no_place.insert(host(i).address);
    send(host(i), i);
  }
  EXPECT_EQ(tries, 3);
  EXPECT_EQ(sender.deadline(), now + DiscoverySender::retry_unknown);
  pass(DiscoverySender::retry_unknown);
  EXPECT_EQ(tries, 4);
  group_error = EAGAIN;
  send(group, 4);
  EXPECT_EQ(sender.deadline(), now + DiscoverySender::retry_min) << "the group waits for no round of others";
}

TEST_F(DiscoverySenderTest, TellsWhatTheSystemRefuses) {
  group_error = ENETUNREACH;
  EXPECT_EQ(send(group, 1), ENETUNREACH);
  EXPECT_EQ(counters.discovery_not_sent, 1U);
  group_error = EAGAIN;
  send(group, 2);
  group_error = ENETUNREACH;
  pass(DiscoverySender::retry_min);
  EXPECT_EQ(counters.discovery_not_sent, 2U);
  EXPECT_EQ(sender.deadline(), std::nullopt);
}

TEST_F(DiscoverySenderTest, DropsFirstWhatIsForUnknownHosts) {
  single_error = group_error = EAGAIN;
  known.insert(host(9).address);
  send(host(9), 1);
  send(host(1), 2);
  send(host(2), 3);
  send(group, 4);
  send(group, 5);
  EXPECT_EQ(counters.discovery_no_room, 1U);
  send(host(3), 6);
  EXPECT_EQ(counters.discovery_no_room, 2U);
  send(group, 7);
  send(host(4), 8);
  EXPECT_EQ(counters.discovery_no_room, 4U);
  single_error = group_error = 0;
  pass(DiscoverySender::retry_max);
  EXPECT_THAT(sent, ElementsAre("single 1", "group 4", "group 5", "group 7"));
}

TEST_F(DiscoverySenderTest, DropsWhatHasWaitedTooLong) {
  group_error = EAGAIN;
  send(group, 1);
  pass(DiscoverySender::max_age);
  EXPECT_EQ(counters.discovery_outdated, 0U);
  pass(DiscoverySender::retry_max);
  EXPECT_EQ(counters.discovery_outdated, 1U);
  EXPECT_EQ(sender.deadline(), std::nullopt);
}

TEST_F(DiscoverySenderTest, TriesOnceMoreAtTheEnd) {
  group_error = single_error = EAGAIN;
  send(group, 1);
  send(host(1), 2);
  group_error = 0;
  sender.finish(now);
  EXPECT_THAT(sent, ElementsAre("group 1"));
  EXPECT_EQ(counters.discovery_outdated, 1U);
  EXPECT_EQ(sender.deadline(), std::nullopt);
}

TEST_F(DiscoverySenderTest, ForgetsWhatWaitsWhenItIsNotTrueAnyMore) {
  group_error = EAGAIN;
  send(group, 1);
  sender.forget();
  group_error = 0;
  pass(DiscoverySender::retry_max);
  EXPECT_THAT(sent, IsEmpty());
  EXPECT_EQ(counters.discovery_outdated, 1U);
}

}  // namespace
}  // namespace trestle::sd::discovery_sender_test
