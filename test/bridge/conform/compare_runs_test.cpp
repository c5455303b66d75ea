#include "bridge/conform/compare_runs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace trestle::conform::compare_runs_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

ReadRun run(const char* name, std::map<std::string, ReadCase> cases) {
  return {.name = name, .version = "1", .started = "2026-01-31T12:00:00Z", .cases = std::move(cases)};
}

const ReadRun before = run("D", {{"sd.offer.a", {"a", Verdict::pass, ""}},
                                 {"sd.offer.b", {"b", Verdict::fail, "TTL is 5"}},
                                 {"sd.offer.c", {"c", Verdict::pass_nonstrict, "late"}},
                                 {"sd.find.d", {"d", Verdict::fail, "no answer"}},
                                 {"rpc.x.e", {"e", Verdict::pass, ""}},
                                 {"rpc.x.f", {"f", Verdict::pass, ""}},
                                 {"rpc.x.h", {"h", Verdict::unsupported, "353 Session IDs in 5 s"}}});
const ReadRun after = run("D", {{"sd.offer.a", {"a", Verdict::fail, "TTL is 6"}},
                                {"sd.offer.b", {"b", Verdict::pass, ""}},
                                {"sd.offer.c", {"c", Verdict::pass_nonstrict, "later"}},
                                {"sd.find.d", {"d", Verdict::fail, "wrong answer"}},
                                {"rpc.x.e", {"e", Verdict::unsupported, "no request"}},
                                {"rpc.x.g", {"g", Verdict::pass, ""}},
                                {"rpc.x.h", {"h", Verdict::unsupported, "362 Session IDs in 5 s"}}});

TEST(RunComparison, TellsWhatBrokeAndWhatWasMended) {
  const RunComparison comparison = compare(before, after);
  std::vector<std::string> lines;
  for (const ChangedCase& one : comparison.changes) {
    lines.push_back(std::to_string(static_cast<int>(one.change)) + " " + one.id);
  }
  // broke, mended, other, gone, added
  EXPECT_THAT(lines, ElementsAre("0 sd.offer.a", "1 sd.offer.b", "2 rpc.x.e", "2 sd.find.d", "3 rpc.x.f",
                                 "4 rpc.x.g"));
  // Why a pass is not strict, or a case is not supported, may differ from run to run.
  EXPECT_EQ(comparison.same, 2U);
}

TEST(RunComparison, IsTextWithReasons) {
  const std::string text = comparison_text(before, after, {});
  EXPECT_THAT(text, HasSubstr("broke (1)\n  sd.offer.a"));
  EXPECT_THAT(text, HasSubstr("pass -> fail: TTL is 6\n"));
  EXPECT_THAT(text, HasSubstr("fail: TTL is 5 -> pass\n"));
  EXPECT_THAT(text, HasSubstr("2 as before\n"));
  EXPECT_THAT(comparison_text(before, before, {}), AllOf(Not(HasSubstr("(1)")), HasSubstr("7 as before")));
}

TEST(StackMatrix, CountsByAreaAndShowsCasesThatAreNotAlike) {
  const StackMatrix matrix = matrix_of({before, after});
  EXPECT_THAT(matrix.names, ElementsAre("D 1", "D 1 (2)"));
  ASSERT_EQ(matrix.areas.size(), 3U);
  EXPECT_EQ(matrix.areas[2].name, "sd.offer");
  EXPECT_EQ(matrix.areas[2].counts[0].good, 2U);
  EXPECT_EQ(matrix.areas[2].counts[0].judged, 3U);
  EXPECT_EQ(matrix.areas[0].name, "rpc.x");
  EXPECT_EQ(matrix.areas[0].counts[1].judged, 1U);  // without the unsupported one
  std::vector<std::string> ids;
  for (const auto& row : matrix.differences) {
    ids.push_back(row.id);
  }
  EXPECT_THAT(ids, ElementsAre("rpc.x.e", "rpc.x.f", "rpc.x.g", "sd.offer.a", "sd.offer.b"));
}

TEST(StackMatrix, IsATableForPeopleAndForPrograms) {
  const StackMatrix matrix = matrix_of({before, after});
  EXPECT_THAT(matrix_text(matrix, {}), HasSubstr("sd.offer                 2/3             2/3\n"));
  EXPECT_THAT(matrix_markdown(matrix), HasSubstr("| sd.offer | 2/3 | 2/3 |\n"));
  EXPECT_THAT(matrix_markdown(matrix), HasSubstr("| sd.offer.a: a | pass | fail: TTL is 6 |\n"));
  const auto json = nlohmann::json::parse(matrix_json(matrix));
  EXPECT_EQ(json["stacks"][1], "D 1 (2)");
  EXPECT_EQ(json["areas"]["sd.offer"][0]["good"], 2);
  EXPECT_EQ(json["differences"][1]["id"], "rpc.x.f");
  EXPECT_TRUE(json["differences"][1]["results"][1].is_null());
}

TEST(ResultsFile, IsReadWithCare) {
  const auto read = parse_results(
      R"({"schema": 1, "device": {"name": "D", "version": "2"}, "cancelled": true,
          "cases": [{"id": "a.b", "title": "t", "verdict": "pass-nonstrict", "reason": "r"}]})",
      "r.json");
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->version, "2");
  EXPECT_TRUE(read->cancelled);
  EXPECT_EQ(read->cases.at("a.b").verdict, Verdict::pass_nonstrict);
  for (const char* text : {"", "[]", "{", "null", R"({"schema": 1})", R"({"schema": 2, "cases": []})",
                           R"({"schema": "1", "cases": []})", R"({"schema": 1, "cases": [7]})",
                           R"({"schema": 1, "cases": [{"id": "a", "verdict": "good"}]})",
                           R"({"schema": 1, "cases": [{"id": 5, "verdict": "pass"}]})"}) {
    const auto wrong = parse_results(text, "r.json");
    ASSERT_FALSE(wrong) << text;
    EXPECT_THAT(wrong.error(), testing::StartsWith("r.json: "));
  }
  EXPECT_TRUE(parse_results(R"({"schema": 1, "device": 3, "started": [], "cases": []})", "r.json"));
  EXPECT_FALSE(read_results("/nowhere"));
}

}  // namespace
}  // namespace trestle::conform::compare_runs_test
