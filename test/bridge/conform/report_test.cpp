#include "bridge/conform/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bridge/conform/capture_writer.hpp"
#include "bridge/conform/selftest.hpp"
#include "pcaps/capture_file.hpp"

namespace trestle::conform::report_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const Case ttl{.id = "sd.offer.ttl",
               .title = "offers with a \"TTL\" < 4",
               .requirements = {"feat_req_someipsd_253"},
               .tc8 = {"SOMEIPSRV_FORMAT_17"}};
const Case comes{.id = "rpc.response.comes", .title = "answers", .requirements = {"feat_req_someip_141"}};

RunResult sample() {
  return {
      .cases = {{.what = &ttl,
                 .outcome = {.verdict = Verdict::fail,
                             .reason = "TTL is 4 & more",
                             .differences = {{.field = "TTL", .expected = "3", .actual = "4", .packet = 5}}},
                 .attempts = 1,
                 .evidence = "sd.offer.ttl.pcapng"},
                {.what = &comes, .outcome = {.verdict = Verdict::unsupported, .reason = "no"}}},
      .started = "2026-01-31T12:00:00Z"};
}
const RunInfo info{.profile_file = "p.yaml",
                   .device = "D",
                   .folder = "out",
                   .seed = 7,
                   .command = "trestle conform run --dut p.yaml"};

TEST(Report, TellsOfAFailureEverythingThatIsNeeded) {
  const std::string text = case_text(sample().cases.front(), info, {});
  EXPECT_THAT(text, HasSubstr("fail  sd.offer.ttl"));
  EXPECT_THAT(text, HasSubstr("TTL is 4 & more"));
  EXPECT_THAT(text, HasSubstr("feat_req_someipsd_253: Offer fields"));
  EXPECT_THAT(text, HasSubstr("out/sd.offer.ttl.pcapng"));
  EXPECT_THAT(text, HasSubstr("trestle conform run --dut p.yaml sd.offer.ttl"));
}

TEST(Report, TellsHowOftenADeviceWasAskedAgain) {
  RunResult run{
      .cases = {{.what = &comes,
                 .outcome = {
                     .verdict = Verdict::pass, .retries = 1, .retried = "answered the 2nd of 3 requests"}}}};
  EXPECT_THAT(case_text(run.cases.front(), info, {}),
              HasSubstr("\n                it answered the 2nd of 3 requests"));
  EXPECT_THAT(junit_xml(run, info), HasSubstr("<property name=\"retries\" value=\"1\"/>"));
  const auto json = nlohmann::json::parse(results_json(run, info));
  EXPECT_EQ(json["cases"][0]["retries"], 1);
  EXPECT_EQ(json["cases"][0]["retried"], "answered the 2nd of 3 requests");
}

TEST(Report, IsJUnitXmlWithASuiteForEachArea) {
  const std::string xml = junit_xml(sample(), info);
  EXPECT_THAT(
      xml, HasSubstr("<testsuite name=\"sd\" timestamp=\"2026-01-31T12:00:00Z\" tests=\"1\" failures=\"1\""));
  EXPECT_THAT(xml,
              HasSubstr("<failure message=\"TTL is 4 &amp; more\">offers with a &quot;TTL&quot; &lt; 4\n"));
  EXPECT_THAT(xml, HasSubstr("<property name=\"tc8\" value=\"SOMEIPSRV_FORMAT_17\"/>"));
  EXPECT_THAT(xml, HasSubstr("<skipped message=\"no\"/>"));
}

TEST(Report, IsJsonWithASchema) {
  const auto json = nlohmann::json::parse(results_json(sample(), info));
  EXPECT_EQ(json["schema"], 1);
  EXPECT_EQ(json["seed"], 7);
  EXPECT_EQ(json["cancelled"], false);
  EXPECT_EQ(json["verdicts"]["fail"], 1);
  EXPECT_EQ(json["verdicts"]["pass"], 0);
  EXPECT_EQ(json["cases"][0]["id"], "sd.offer.ttl");
  EXPECT_EQ(json["cases"][0]["differences"][0]["packet"], 5);
  EXPECT_EQ(json["cases"][0]["requirements"][0], "feat_req_someipsd_253");
}

TEST(Evidence, CanBeReadAsACapture) {
  const Endpoint a{IpAddress::v4(192, 0, 2, 1), 30490};
  const Endpoint b{IpAddress::v4(192, 0, 2, 2), 30501};
  const std::string bytes = pcapng({{.number = 1,
                                     .time = WallTime{std::chrono::seconds{5}},
                                     .from = a,
                                     .to = b,
                                     .bytes = {std::byte{0xab}, std::byte{0xcd}},
                                     .comment = "OFFENDING: it"},
                                    {.number = 2,
                                     .time = WallTime{std::chrono::seconds{6}},
                                     .transport = Transport::tcp,
                                     .from = b,
                                     .to = a,
                                     .bytes = {std::byte{0xef}}}},
                                   "title");
  EXPECT_THAT(bytes, HasSubstr("OFFENDING: it"));
  const std::string file = testing::TempDir() + "conform_evidence_" + std::to_string(getpid()) + ".pcapng";
  std::ofstream{file, std::ios::binary} << bytes;
  pcaps::CaptureFile capture{file};
  const auto first = capture.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->bytes.size(), 20U + 8U + 2U);
  EXPECT_EQ(first->time.time_since_epoch(), std::chrono::seconds{5});
  EXPECT_EQ(first->bytes.back(), std::byte{0xcd});
  const auto second = capture.next();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->bytes.size(), 20U + 20U + 1U);
  EXPECT_FALSE(capture.next());
  EXPECT_EQ(capture.error(), "");
  std::remove(file.c_str());
}

TEST(Selftest, ReadsWhatTheDeviceLists) {
  const auto faults = read_faults("ack-lost\tsd.subscribe,event\tno Ack\nnonsense\n");
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "ack-lost");
  EXPECT_THAT(faults[0].finders, ElementsAre("sd.subscribe", "event"));
}

TEST(Selftest, CountsFaultsThatNobodyFindsAndCasesThatFindNone) {
  const SelftestResult result{
      .reference = {.cases = {{.what = &ttl}, {.what = &comes}}},
      .faults = {{.fault = {.name = "a"}, .found_by = {"sd.offer.ttl"}}, {.fault = {.name = "b"}}}};
  EXPECT_EQ(result.found(), 1U);
  EXPECT_THAT(result.blind_cases(), ElementsAre("rpc.response.comes"));
}

}  // namespace
}  // namespace trestle::conform::report_test
