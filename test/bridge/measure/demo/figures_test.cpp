#include "bridge/measure/demo/figures.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "bridge/cli/terminal.hpp"
#include "bridge/measure/demo/screen.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::figures_test {
namespace {

using namespace measure::demo;
using cli::duration_text;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t second = 1'000 * ms;

/// A demo as its processes would report it; times in ms from the start.
class CannedDemo {
 public:
  void matched(Process from, int count) {
    figures.on_line(from, fmt::format(R"({{"event":"matched","count":{}}})", count), now);
  }
  void published(int stamp, std::int64_t at_ms) {
    now = at_ms * ms;
    figures.on_line(
        Process::publisher,
        fmt::format(R"({{"event":"published","stamp_ns":{},"checksum":{},"bytes":3000000,"time_ns":{}}})",
                    stamp, checksum(stamp), at_ms * ms),
        now);
  }
  void received(int stamp, std::int64_t at_ms, bool intact = true) {
    now = at_ms * ms;
    figures.on_line(
        Process::subscriber,
        fmt::format(R"({{"event":"received","stamp_ns":{},"checksum":{},"bytes":3000000,"time_ns":{}}})",
                    stamp, checksum(stamp) + (intact ? 0 : 1), at_ms * ms),
        now);
  }
  static std::uint64_t checksum(int stamp) { return 0xfedc'ba98'7654'3210 + static_cast<unsigned>(stamp); }
  void carried(Process from, int session, std::int64_t before_ns, std::int64_t after_ns) {
    figures.on_line(
        from,
        fmt::format(
            R"({{"event":"carried","route":"/points","direction":"x","session":{},"before_ns":{},"after_ns":{},"bytes":1}})",
            session, before_ns, after_ns),
        now);
  }
  /// Everybody finds everybody, and cloud 1 crosses, at 0 to 100 ms.
  void discover() {
    published(1, 10);
    matched(Process::publisher, 1);
    matched(Process::subscriber, 1);
    now = 100 * ms;
    carried(Process::bridge_a, 1, 11 * ms, 12 * ms);
  }
  /// Clouds from `first` to `last` are published every 100 ms and cross in 20 ms.
  void cross(int first, int last) {
    for (int stamp = first; stamp <= last; ++stamp) {
      published(stamp, 100 * stamp);
      received(stamp, 100 * stamp + 20);
    }
  }

  Figures figures;
  std::int64_t now = 0;
};

TEST(DemoFigures, WaitForDiscoveryOnAllThreeSides) {
  CannedDemo run;
  EXPECT_EQ(run.figures.missing(),
            "publisher and bridge A have not found each other over DDS; subscriber and bridge B have not "
            "found each "
            "other over DDS");
  run.matched(Process::publisher, 1);
  run.matched(Process::subscriber, 1);
  EXPECT_FALSE(run.figures.discovered());
  EXPECT_EQ(run.figures.missing(), "bridge A has no subscriber over SOME/IP");
  // Bridge B alone can't carry anything: this must not count.
  run.carried(Process::bridge_b, 1, 0, 1);
  EXPECT_FALSE(run.figures.discovered());
  run.carried(Process::bridge_a, 1, 0, 1);
  EXPECT_TRUE(run.figures.discovered());
  EXPECT_EQ(run.figures.missing(), "");
}

TEST(DemoFigures, LeaveOutCloudsFromBeforeDiscovery) {
  CannedDemo run;
  run.published(1, 0);
  run.published(2, 50);
  run.discover();  // cloud 1 once more
  // Published before, and arriving after: neither sent nor arrived.
  run.received(2, 110);
  EXPECT_EQ(run.figures.counts().early, 3U);
  EXPECT_EQ(run.figures.counts().sent, 0U);
  EXPECT_EQ(run.figures.counts().arrived, 0U);
  EXPECT_EQ(run.figures.counts().duplicates, 0U);
  EXPECT_EQ(run.figures.fault(), "no cloud was sent after discovery");
}

TEST(DemoFigures, AreGoodWhenEveryCloudArrives) {
  CannedDemo run;
  run.discover();
  run.cross(2, 21);
  EXPECT_EQ(run.figures.counts().sent, 20U);
  EXPECT_EQ(run.figures.counts().arrived, 20U);
  EXPECT_EQ(run.figures.outstanding(), 0U);
  EXPECT_EQ(run.figures.fault(), "");
}

TEST(DemoFigures, DemandNinetyFiveOfAHundred) {
  CannedDemo run;
  run.discover();
  run.cross(2, 96);  // 95 clouds
  for (int stamp = 97; stamp <= 101; ++stamp) {
    run.published(stamp, 100 * stamp);
  }
  EXPECT_EQ(run.figures.counts().sent, 100U);
  EXPECT_EQ(run.figures.counts().arrived, 95U);
  EXPECT_EQ(run.figures.outstanding(), 5U);
  EXPECT_EQ(run.figures.fault(), "");
  run.published(102, 10'200);
  EXPECT_EQ(run.figures.fault(), "only 95 of 101 clouds arrived, less than 95 %");
}

TEST(DemoFigures, FailOnOneDamagedCloud) {
  CannedDemo run;
  run.discover();
  run.cross(2, 200);
  run.published(201, 20'100);
  run.received(201, 20'120, false);
  EXPECT_EQ(run.figures.counts().corrupt, 1U);
  EXPECT_EQ(run.figures.counts().arrived, 199U);
  EXPECT_EQ(run.figures.outstanding(), 1U);
  EXPECT_EQ(run.figures.fault(), "1 of the clouds that arrived were not what was sent");
}

TEST(DemoFigures, FailOnADamagedCloudThatCannotEvenBeRead) {
  CannedDemo run;
  run.discover();
  run.cross(2, 200);
  static_cast<void>(run.figures.take_log());
  run.figures.on_line(Process::subscriber, R"({"event":"unreadable","reason":"not plain CDR"})", run.now);
  EXPECT_EQ(run.figures.counts().corrupt, 1U);
  EXPECT_NE(run.figures.fault(), "");
  EXPECT_THAT(run.figures.take_log(), ElementsAre("subscriber: received a damaged cloud: not plain CDR"));
}

// Whether its line may still come is known from the times, and at the end.
TEST(DemoFigures, FailOnACloudWhoseStampWasNeverSent) {
  CannedDemo run;
  run.discover();
  run.cross(2, 10);
  run.received(11'000, 1'050);
  EXPECT_EQ(run.figures.counts().corrupt, 0U);
  run.published(11, 1'040);
  EXPECT_EQ(run.figures.counts().corrupt, 0U);
  run.published(12, 1'100);
  EXPECT_EQ(run.figures.counts().corrupt, 1U);
  run.received(5'000, 1'150);
  EXPECT_EQ(run.figures.counts().corrupt, 1U);
  run.figures.on_line(Process::publisher, R"({"event":"finished","published":11})", run.now);
  EXPECT_EQ(run.figures.counts().corrupt, 2U);
  EXPECT_EQ(run.figures.counts().arrived, 9U);
  EXPECT_EQ(run.figures.outstanding(), 2U);
}

TEST(DemoFigures, SeeDamageFromBeforeDiscoveryToo) {
  CannedDemo run;
  run.discover();
  run.received(1, 110, false);
  EXPECT_EQ(run.figures.counts().corrupt, 1U);
}

TEST(DemoFigures, CountADuplicateOnceAndNotAsArrived) {
  CannedDemo run;
  run.discover();
  run.cross(2, 3);
  run.received(3, 330);
  EXPECT_EQ(run.figures.counts().arrived, 2U);
  EXPECT_EQ(run.figures.counts().duplicates, 1U);
}

TEST(DemoFigures, DoNotMindWhoReportsFirst) {
  CannedDemo run;
  run.discover();
  run.received(2, 220);  // the publisher's line is still in its pipe
  EXPECT_EQ(run.figures.counts().arrived, 0U);
  run.published(2, 200);
  EXPECT_EQ(run.figures.counts().arrived, 1U);
  EXPECT_EQ(run.figures.leg(Leg::end_to_end).percentile(50), 20 * ms);
}

TEST(DemoFigures, CountWhatDdsRefusesAsLost) {
  CannedDemo run;
  run.discover();
  run.cross(2, 10);
  run.figures.on_line(Process::publisher, R"({"event":"refused","reason":"timeout"})", run.now);
  EXPECT_EQ(run.figures.counts().sent, 10U);
  EXPECT_EQ(run.figures.outstanding(), 1U);
  EXPECT_EQ(run.figures.lost(run.now), 1U);
  EXPECT_EQ(run.figures.fault(), "only 9 of 10 clouds arrived, less than 95 %");
}

TEST(DemoFigures, CallNothingLostThatMayBeUnderWay) {
  CannedDemo run;
  run.discover();
  run.published(2, 1000);
  EXPECT_EQ(run.figures.lost(1'000 * ms), 0U);
  EXPECT_EQ(run.figures.lost(2'000 * ms), 0U);
  EXPECT_EQ(run.figures.lost(2'001 * ms), 1U);
  EXPECT_EQ(run.figures.outstanding(), 1U);
}

TEST(DemoFigures, MeasureTheLegsBetweenCheckpoints) {
  CannedDemo run;
  run.discover();
  const std::int64_t start = 200 * ms;
  run.carried(Process::bridge_a, 7, start, start + 11);
  run.carried(Process::bridge_b, 7, start + 1'011, start + 1'033);
  // The bridges' lines may come the other way round.
  run.carried(Process::bridge_b, 8, start + 5'000, start + 5'022);
  run.carried(Process::bridge_a, 8, start + 3'000, start + 3'011);
  EXPECT_EQ(run.figures.leg(Leg::to_someip).percentile(50), 11);
  EXPECT_EQ(run.figures.leg(Leg::to_dds).percentile(50), 22);
  EXPECT_EQ(run.figures.leg(Leg::transport).count(), 2U);
  EXPECT_EQ(run.figures.leg(Leg::transport).percentile(50), 1'000);
  EXPECT_EQ(run.figures.leg(Leg::transport).percentile(99), 1'989);
}

TEST(DemoFigures, DoNotJoinMessagesWhoseSessionIdOnlyLooksTheSame) {
  CannedDemo run;
  run.discover();
  run.carried(Process::bridge_a, 7, 1 * second, 1 * second + 1);  // bridge B never got it
  // The session id has wrapped.
  run.carried(Process::bridge_b, 7, 6'000 * second, 6'000 * second + 1);
  EXPECT_EQ(run.figures.leg(Leg::transport).count(), 0U);
  run.carried(Process::bridge_a, 7, 5'999 * second, 6'000 * second - 5);
  EXPECT_EQ(run.figures.leg(Leg::transport).count(), 1U);
  EXPECT_EQ(run.figures.leg(Leg::transport).percentile(50), 5);
  // Came before anything left.
  run.carried(Process::bridge_b, 9, 7'000 * second, 7'000 * second + 1);
  run.carried(Process::bridge_a, 9, 7'001 * second, 7'001 * second + 1);
  EXPECT_EQ(run.figures.leg(Leg::transport).count(), 1U);
}

TEST(DemoFigures, TellTheRate) {
  CannedDemo run;
  run.discover();
  run.cross(2, 101);
  // 100 clouds of 3 MB, 10 a second; the first one starts the clock.
  EXPECT_NEAR(run.figures.rate().clouds_per_second, 10.0, 1e-9);
  EXPECT_NEAR(run.figures.rate().megabytes_per_second, 30.0, 1e-9);
  EXPECT_NEAR(run.figures.rate_now(run.now).clouds_per_second, 10.0, 0.5);
  EXPECT_EQ(run.figures.rate_now(run.now + 10 * second).clouds_per_second, 0);
  EXPECT_EQ(CannedDemo{}.figures.rate().clouds_per_second, 0);
}

TEST(DemoFigures, KeepALogOfDiscovery) {
  CannedDemo run;
  run.figures.on_line(Process::bridge_a, R"({"event":"discovery","text":"offering 0x1111.0x0001"})", 0);
  run.matched(Process::publisher, 1);
  run.matched(Process::publisher, 2);
  run.matched(Process::publisher, 0);
  EXPECT_THAT(run.figures.take_log(),
              ElementsAre("bridge A: offering 0x1111.0x0001", "publisher: found bridge A over DDS",
                          "publisher: lost bridge A over DDS"));
  EXPECT_THAT(run.figures.take_log(), IsEmpty());
}

TEST(DemoFigures, SurviveLinesThatMakeNoSense) {
  CannedDemo run;
  run.discover();
  run.cross(2, 3);
  const auto before = run.figures.to_json();
  int lines = 0;
  for (const char* line :
       {"", "{", "[]", "null", "1", "\"published\"", "{}", R"({"event":1})", R"({"event":"published"})",
        R"({"event":"published","stamp_ns":"x","checksum":1,"time_ns":1})",
        R"({"event":"published","stamp_ns":9,"checksum":"x","time_ns":1})",
        R"({"event":"received","stamp_ns":1})", R"({"event":"unreadable"})",
        R"({"event":"received","stamp_ns":[],"checksum":1,"bytes":1,"time_ns":1})",
        R"({"event":"carried","session":1})", R"({"event":"matched"})", R"({"event":"discovery","text":5})",
        R"({"event":"counters"})", "\xff\xfe"}) {
    for (const Process from :
         {Process::publisher, Process::bridge_a, Process::bridge_b, Process::subscriber}) {
      run.figures.on_line(from, line, run.now);
      ++lines;
    }
  }
  auto after = run.figures.to_json();
  EXPECT_EQ(after["unreadable_lines"], lines);
  after["unreadable_lines"] = 0;
  EXPECT_EQ(after, before);
}

TEST(DemoFigures, BecomeTheJsonThatIsDocumented) {
  CannedDemo run;
  run.discover();
  run.cross(2, 3);
  run.carried(Process::bridge_a, 7, 1 * second, 1 * second + 11);
  run.carried(Process::bridge_b, 7, 1 * second + 500, 1 * second + 522);
  run.figures.on_line(Process::bridge_b, R"({"event":"counters","group":"SOME/IP","malformed":3})", run.now);
  EXPECT_EQ(run.figures.to_json().dump(1), R"({
 "ok": true,
 "fault": "",
 "clouds": {
  "before_discovery": 1,
  "sent": 2,
  "refused": 0,
  "arrived": 2,
  "lost": 0,
  "corrupt": 0,
  "duplicates": 0
 },
 "clouds_per_second": 10.0,
 "megabytes_per_second": 30.0,
 "latency_ns": {
  "dds_to_someip_conversion": {
   "count": 1,
   "p50": 11,
   "p99": 11,
   "max": 11
  },
  "someip_transport": {
   "count": 1,
   "p50": 489,
   "p99": 489,
   "max": 489
  },
  "someip_to_dds_conversion": {
   "count": 1,
   "p50": 22,
   "p99": 22,
   "max": 22
  },
  "publish_to_receive": {
   "count": 2,
   "p50": 20000000,
   "p99": 20000000,
   "max": 20000000
  }
 },
 "counters": {
  "bridge B": {
   "SOME/IP": {
    "malformed": 3
   }
  }
 },
 "unreadable_lines": 0
})");
}

TEST(DemoFigures, AreAllDocumented) {
  std::ifstream in{test::source_dir() + "/docs/demo.md"};
  const std::string text{std::istreambuf_iterator<char>{in}, {}};
  const auto figures = Figures{}.to_json();
  for (const auto& [key, value] : figures.items()) {
    EXPECT_THAT(text, testing::HasSubstr("`" + key + "`"));
    if (value.is_object()) {
      for (const auto& [inner, ignored] : value.items()) {
        EXPECT_THAT(text, testing::HasSubstr("`" + inner + "`"));
      }
    }
  }
}

TEST(DemoScreen, ShowsThreeDigitsThatMatter) {
  EXPECT_EQ(duration_text(0), "0 ns");
  EXPECT_EQ(duration_text(812), "812 ns");
  EXPECT_EQ(duration_text(1'000), "1.00 us");
  EXPECT_EQ(duration_text(3'456), "3.46 us");
  EXPECT_EQ(duration_text(9'996), "10.0 us");
  EXPECT_EQ(duration_text(12'340'000), "12.3 ms");
  EXPECT_EQ(duration_text(123'400'000), "123 ms");
  EXPECT_EQ(duration_text(999'900'000), "1.00 s");
  EXPECT_EQ(duration_text(12'000'000'000), "12.0 s");
}

TEST(DemoScreen, ShowsTheFiguresAsATable) {
  CannedDemo run;
  run.discover();
  run.cross(2, 11);
  run.published(12, 1200);
  run.carried(Process::bridge_a, 7, 1 * second, 1 * second + 11'000);
  EXPECT_EQ(
      table(run.figures, run.figures.rate(), run.figures.outstanding(), {.red = "<red>", .off = "<off>"}),
      "  clouds   sent 11   arrived intact 10   <red>lost 1<off>   corrupt 0\n"
      "  rate     10.0 clouds/s   30.0 MB/s\n"
      "\n"
      "  time between checkpoints               p50         p99<off>\n"
      "  ①→② DDS to SOME/IP conversion      11.0 us     11.0 us\n"
      "  ②→③ SOME/IP transport                    -           -\n"
      "  ③→④ SOME/IP to DDS conversion            -           -\n"
      "      publish to receive             20.0 ms     20.0 ms\n");
  EXPECT_EQ(
      one_line(run.figures, run.now, std::chrono::seconds{2}),
      "   2 s  sent 11  arrived 10  lost 0  corrupt 0  9.1 clouds/s  27.3 MB/s  p50 20.0 ms  p99 20.0 ms\n");
}

}  // namespace
}  // namespace trestle::test::figures_test
