#include "bridge/carry/runtime/route_meter.hpp"

#include <gmock/gmock.h>

#include "test/bridge/carry/runtime/virtual_clock.hpp"

namespace trestle::test::route_meter_test {
namespace {

using carry::RoutePicture;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

class Meter : public testing::Test {
 protected:
  /// A message that comes now and is converted for so long.
  void carry(std::chrono::nanoseconds conversion, std::chrono::nanoseconds source = -1ns) {
    const auto now = clock_.now();
    meter_.came(now);
    meter_.carried({.came = now,
                    .before = now + 10ns,
                    .after = now + 10ns + conversion,
                    .sent = now + 15ns + conversion,
                    .source = source,
                    .bytes = 100,
                    .session = someip::SessionId{7}});
  }
  [[nodiscard]] RoutePicture picture() const {
    RoutePicture result;
    meter_.fill(result, clock_);
    return result;
  }
  [[nodiscard]] std::vector<std::int64_t> slowest() const {
    std::vector<std::int64_t> result;
    for (const carry::SlowMessagePicture& one : picture().slowest) {
      result.push_back(one.convert_ns);
    }
    return result;
  }

  VirtualClock clock_;
  carry::RouteMeter meter_;
};

TEST_F(Meter, SaysNothingAtFirst) {
  EXPECT_EQ(picture().last_ns, 0);
  EXPECT_EQ(picture().last_carried_ns, 0);
  EXPECT_EQ(picture().conversion.count, 0U);
  EXPECT_THAT(slowest(), IsEmpty());
}

TEST_F(Meter, TellsRatesAndLatencies) {
  for (int i = 0; i < 100; ++i) {
    carry(i < 90 ? 1000ns : 5000ns);
    clock_.pass(100ms);
  }
  const RoutePicture now = picture();
  EXPECT_NEAR(now.per_second, 10, 0.5);
  EXPECT_NEAR(now.bytes_per_second, 1000, 50);
  EXPECT_EQ(now.last_ns, (clock_.since_1970() - 100ms).count());
  EXPECT_EQ(now.conversion.count, 100U);
  EXPECT_NEAR(static_cast<double>(now.conversion.p50_ns), 1000, 125);
  EXPECT_NEAR(static_cast<double>(now.conversion.p99_ns), 5000, 625);
  EXPECT_EQ(now.conversion.min_ns, 1000);
  EXPECT_EQ(now.conversion.max_ns, 5000);
  EXPECT_EQ(now.conversion.sum_ns, 90 * 1000 + 10 * 5000);
  EXPECT_EQ(now.path.max_ns, 5015) << "since it came";
}

TEST_F(Meter, TakesThePathFromItsSource) {
  carry(1000ns, 3ms);
  carry(1000ns, 0ns);
  EXPECT_EQ(picture().path.max_ns, 3'000'000);
  EXPECT_EQ(picture().path.min_ns, 0);
}

TEST_F(Meter, KeepsTheSlowestOfTheLastMinuteOrTwo) {
  for (const auto conversion : {5ns, 90ns, 7ns, 8ns, 80ns, 70ns, 60ns, 9ns}) {
    carry(conversion);
  }
  EXPECT_THAT(slowest(), ElementsAre(90, 80, 70, 60));
  const carry::SlowMessagePicture first = picture().slowest.front();
  EXPECT_EQ(first.at_ns, clock_.since_1970().count());
  EXPECT_EQ(first.waited_ns, 10);
  EXPECT_EQ(first.send_ns, 5);
  EXPECT_EQ(first.source_ns, -1);
  EXPECT_EQ(first.bytes, 100U);
  EXPECT_EQ(first.session, 7U);
  clock_.pass(61s);
  carry(85ns);
  EXPECT_THAT(slowest(), ElementsAre(90, 85, 80, 70));
  clock_.pass(61s);
  carry(1ns);
  EXPECT_THAT(slowest(), ElementsAre(85, 1));
  clock_.pass(10min);
  EXPECT_THAT(slowest(), IsEmpty());
  carry(2ns);
  EXPECT_THAT(slowest(), ElementsAre(2));
}

TEST_F(Meter, NotesWhatIsNotConverted) {
  meter_.came(clock_.now());
  EXPECT_EQ(picture().last_carried_ns, 0);
  meter_.carried(clock_.now(), 0);
  EXPECT_EQ(picture().last_carried_ns, clock_.since_1970().count());
  EXPECT_EQ(picture().conversion.count, 0U);
}

}  // namespace
}  // namespace trestle::test::route_meter_test
