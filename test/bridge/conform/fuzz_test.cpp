#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "bridge/conform/capture_writer.hpp"
#include "bridge/conform/fuzz/coverage_map.hpp"
#include "bridge/conform/fuzz/finding.hpp"
#include "bridge/conform/fuzz/fuzz_report.hpp"
#include "bridge/conform/fuzz/player.hpp"
#include "bridge/conform/fuzz/process_watch.hpp"
#include "bridge/conform/fuzz/rule_watch.hpp"
#include "bridge/conform/fuzz/sequences.hpp"
#include "bridge/conform/stimulus.hpp"

namespace trestle::conform::fuzz_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

const Endpoint tester{.address = IpAddress::v4(10, 0, 0, 2), .port = 40'490};
const Endpoint device{.address = IpAddress::v4(10, 0, 0, 1), .port = 30'501};

Profile profile() {
  return {.device = device.address,
          .tester = tester.address,
          .services = {{.service = someip::ServiceId{0x1234},
                        .udp_port = device.port,
                        .tcp_port = device.port,
                        .eventgroups = {{.id = someip::EventgroupId{3}}},
                        .request = RequestProfile{.method = someip::MethodId{8}}}},
          .uses = {{.service = someip::ServiceId{0x77}}}};
}

Packet packet(bool sent, Transport transport, const fuzz::Bytes& bytes) {
  return {.time = WallTime{1s},
          .sent = sent,
          .transport = transport,
          .from = sent ? tester : device,
          .to = sent ? device : tester,
          .bytes = bytes};
}

// --- Sequences --------------------------------------------------------------------------------------------

TEST(Sequences, LeadIntoEachStateAndUseEachWay) {
  const Sequences sequences{targets_of(profile()), wanted_services(profile()), tester};
  fuzz::Random random{1};
  std::set<std::string> states;
  std::set<Way> ways;
  for (int count = 0; count < 400; ++count) {
    const Sequence one = sequences.make(random);
    states.insert(one.state);
    for (const Step& step : one.steps) {
      ways.insert(step.way);
    }
  }
  EXPECT_EQ(states, (std::set<std::string>{"subscribed", "connected", "half a message", "calls pending",
                                           Sequences::after_reboot, "offered", "idle"}));
  EXPECT_EQ(ways.size(), 5U);
}

TEST(Sequences, AreTheSameForTheSameSeed) {
  const Sequences sequences{targets_of(profile()), {}, tester};
  fuzz::Random one{7};
  fuzz::Random same{7};
  for (int count = 0; count < 50; ++count) {
    const Sequence first = sequences.changed(sequences.make(one), sequences.make(one), one);
    const Sequence second = sequences.changed(sequences.make(same), sequences.make(same), same);
    ASSERT_EQ(first.steps.size(), second.steps.size());
    for (std::size_t at = 0; at < first.steps.size(); ++at) {
      EXPECT_EQ(first.steps[at].bytes, second.steps[at].bytes);
    }
  }
}

TEST(Sequences, NeverCallWhatMakesTheDeviceSilentOnPurpose) {
  Profile with_ets = profile();
  with_ets.ets = true;
  const Sequences sequences{targets_of(with_ets), {}, tester};
  fuzz::Random random{3};
  const Bytes suspend = bytes({0x12, 0x34, 0x00, 0x02});
  for (int count = 0; count < 3'000; ++count) {
    for (const Step& step : sequences.make(random).steps) {
      EXPECT_EQ(std::search(step.bytes.begin(), step.bytes.end(), suspend.begin(), suspend.end()),
                step.bytes.end());
    }
  }
}

// --- The shortest way to a finding ------------------------------------------------------------------------

Step step(unsigned number, std::size_t size = 16) {
  Step one{.way = Way::udp, .port = 1, .bytes = fuzz::Bytes(size)};
  one.bytes[0] = static_cast<std::byte>(number);
  return one;
}

TEST(Minimised, LeavesWhatIsNeeded) {
  Sequence all;
  for (unsigned number = 0; number < 20; ++number) {
    all.steps.push_back(step(number, 200));
  }
  // It takes 3, and later 17, of at least 50 bytes.
  const auto shows = [](const Sequence& one) {
    const auto first = std::ranges::find(one.steps, std::byte{3}, [](const Step& s) { return s.bytes[0]; });
    return std::any_of(first, one.steps.end(),
                       [](const Step& s) { return s.bytes[0] == std::byte{17} && s.bytes.size() >= 50; });
  };
  const Sequence small = minimised(all, 200, shows);
  ASSERT_EQ(small.steps.size(), 2U);
  EXPECT_EQ(small.steps[0].bytes.size(), 16U);
  EXPECT_GE(small.steps[1].bytes.size(), 50U);
  EXPECT_LT(small.steps[1].bytes.size(), 110U);
}

TEST(Minimised, TriesNoMoreOftenThanItMay) {
  Sequence all{.steps = std::vector<Step>(64, step(1))};
  std::size_t tries = 0;
  (void)minimised(all, 10, [&](const Sequence&) {
    ++tries;
    return false;
  });
  EXPECT_EQ(tries, 10U);
}

// --- What a device must not send --------------------------------------------------------------------------

Bytes response(std::uint8_t type = 0x80) {
  return Call{.service = someip::ServiceId{0x1234},
              .method = someip::MethodId{8},
              .type = static_cast<someip::MessageType>(type),
              .session = someip::SessionId{5}}
      .encode();
}

Bytes request() {
  return Call{
      .service = someip::ServiceId{0x1234}, .method = someip::MethodId{8}, .session = someip::SessionId{5}}
      .encode();
}

TEST(RuleWatch, SaysNothingOfARightAnswer) {
  EXPECT_TRUE(
      broken_rules({packet(true, Transport::udp, request()), packet(false, Transport::udp, response())},
                   device.address)
          .empty());
}

TEST(RuleWatch, FindsAnUnknownTypeAndAnswersThatAreTooMany) {
  const auto type =
      broken_rules({packet(true, Transport::udp, request()), packet(false, Transport::udp, response(0xc0))},
                   device.address);
  ASSERT_EQ(type.size(), 1U);
  EXPECT_THAT(type[0].id, HasSubstr("header"));

  const std::deque<Packet> twice{packet(true, Transport::udp, request()),
                                 packet(false, Transport::udp, response()),
                                 packet(false, Transport::udp, response())};
  const auto often = broken_rules(twice, device.address);
  ASSERT_EQ(often.size(), 1U);
  EXPECT_EQ(often[0].id, "rpc.answered-once");
  // Whoever asks twice gets two answers, also when one of them stands in another message.
  std::deque<Packet> asked = twice;
  asked.push_front(packet(true, Transport::udp, request()));
  EXPECT_TRUE(broken_rules(asked, device.address).empty());
}

TEST(RuleWatch, BlamesNobodyForAnEchoOfTooMuch) {
  const auto large = [](std::uint8_t type) {
    return Call{.service = someip::ServiceId{0x1234},
                .method = someip::MethodId{8},
                .payload = Bytes(1405),
                .type = static_cast<someip::MessageType>(type),
                .session = someip::SessionId{5}}
        .encode();
  };
  const auto from_small = broken_rules(
      {packet(true, Transport::udp, request()), packet(false, Transport::udp, large(0x80))}, device.address);
  ASSERT_EQ(from_small.size(), 1U);
  EXPECT_EQ(from_small[0].id, "pcap.udp.size");
  EXPECT_TRUE(
      broken_rules({packet(true, Transport::udp, large(0)), packet(false, Transport::udp, large(0x80))},
                   device.address)
          .empty());
}

// --- Captures ---------------------------------------------------------------------------------------------

TEST(SequenceOfCapture, HasTheStepsAndPausesOfTheTester) {
  std::deque<Packet> packets{
      packet(true, Transport::udp, request()), packet(false, Transport::udp, response()),
      packet(true, Transport::tcp, bytes({1, 2, 3})), packet(true, Transport::tcp, {})};
  packets[2].time += 40ms;
  packets[3].time += 45ms;
  packets[3].ends = true;
  Packet discovery = packet(true, Transport::udp, bytes({4}));
  discovery.to = {profile().multicast, profile().sd_port};
  discovery.time += 50ms;
  packets.push_back(discovery);
  const std::string file = testing::TempDir() + "steps-" + std::to_string(::getpid()) + ".pcapng";
  std::ofstream{file, std::ios::binary} << pcapng(packets, "steps");

  const Sequence sequence = sequence_of_capture(file, profile());
  ASSERT_EQ(sequence.steps.size(), 4U);
  EXPECT_EQ(sequence.steps[0].way, Way::udp);
  EXPECT_EQ(sequence.steps[0].port, device.port);
  EXPECT_EQ(sequence.steps[0].bytes, request());
  EXPECT_EQ(sequence.steps[0].pause, 40ms);
  EXPECT_EQ(sequence.steps[1].way, Way::tcp);
  EXPECT_EQ(sequence.steps[1].bytes, bytes({1, 2, 3}));
  EXPECT_EQ(sequence.steps[2].way, Way::tcp_close);
  EXPECT_EQ(sequence.steps[3].way, Way::sd_multicast);

  Profile other = profile();
  other.tester = IpAddress::v4(10, 9, 9, 9);
  EXPECT_THROW((void)sequence_of_capture(file, other), std::runtime_error);
  ::unlink(file.c_str());
}

// --- The device's process ---------------------------------------------------------------------------------

TEST(ProcessWatch, SeesMemoryAndDescriptors) {
  const auto means = means_of(::getpid());
  ASSERT_TRUE(means);
  EXPECT_GT(means->memory, 100'000U);
  EXPECT_GE(means->descriptors, 3U);
  EXPECT_EQ(largest_of_group(::getpgrp()).has_value(), true);
  EXPECT_EQ(means_of(-5), std::nullopt);
}

TEST(CoverageMap, TellsOfPlacesOnce) {
  const std::string file = testing::TempDir() + "coverage-" + std::to_string(::getpid());
  CoverageMap map{file};
  EXPECT_EQ(::getenv("TRESTLE_COVERAGE"), file);
  EXPECT_FALSE(map.grown());
  std::fstream device_side{file, std::ios::in | std::ios::out | std::ios::binary};
  device_side.seekp(99);
  device_side.put('\1');
  device_side.flush();
  EXPECT_TRUE(map.grown());
  device_side.seekp(99);
  device_side.put('\1');
  device_side.flush();
  EXPECT_FALSE(map.grown());
  EXPECT_EQ(map.count(), 1U);
  ::unlink(file.c_str());
}

// --- Reports ----------------------------------------------------------------------------------------------

TEST(FuzzReport, HasEverythingOfAFinding) {
  FuzzResult result{.done = {.sequences = 10}, .states = {{"idle", 10}}};
  result.findings.push_back({.kind = FindingKind::ended,
                             .key = "crash",
                             .what = "the device was killed by signal 6 <&>",
                             .sequence = {.state = "idle", .steps = {step(9)}},
                             .confirmed = true,
                             .steps_found = 12,
                             .evidence = "finding-001-crash.pcapng"});
  result.unconfirmed = {{"restart", 2}, {"slowness", 3}};
  const FuzzInfo info{.device = "ECU", .profile_file = "ecu.yaml", .folder = "night", .seed = 7};
  const auto json = nlohmann::json::parse(fuzz_json(result, info));
  EXPECT_EQ(json["schema"], 1);
  EXPECT_EQ(json["findings"][0]["kind"], "crash");
  EXPECT_EQ(json["findings"][0]["again"],
            "trestle fuzz --dut ecu.yaml --replay night/finding-001-crash.pcapng");
  EXPECT_EQ(json["findings"][0]["steps"][0]["bytes"], "09" + std::string(30, '0'));
  const std::string page = fuzz_page(result, info);
  EXPECT_THAT(page, HasSubstr("signal 6 &lt;&amp;&gt;"));
  EXPECT_THAT(page, HasSubstr("finding-001-crash.pcapng"));
  EXPECT_THAT(page, Not(HasSubstr("http://")));
  EXPECT_THAT(fuzz_summary(result, info), HasSubstr("1 finding;"));
  EXPECT_EQ(json["unconfirmed"], 5);
  EXPECT_EQ(json["unconfirmed_signs"]["slowness"], 3);
  EXPECT_THAT(fuzz_summary(result, info), HasSubstr("; 3 times slowness, which a second run did not show"));
}

}  // namespace
}  // namespace trestle::conform::fuzz_test
