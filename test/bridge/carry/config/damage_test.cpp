#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "bridge/carry/config/load.hpp"
#include "test/bridge/carry/config/good_config.hpp"

/// Whatever happens to a configuration, the answer is a good one or a list of errors with places inside the
/// file.
namespace trestle::test::damage_test {
namespace {

using namespace carry;

void expect_sane(const std::string& text, const std::string& what) {
  const auto loaded = parse_config(text, "b.yaml");
  if (loaded) {
    EXPECT_FALSE(loaded->config.routes.empty()) << what;
    return;
  }
  EXPECT_FALSE(loaded.error().empty()) << what;
  const auto line_count = std::count(text.begin(), text.end(), '\n') + 1;
  bool any_error = false;
  for (const documents::Problem& problem : loaded.error()) {
    any_error = any_error || problem.severity == documents::Problem::Severity::error;
    EXPECT_LE(problem.mark.line, line_count + 1) << what << ": " << to_string(problem);
    EXPECT_EQ(problem.text.find('\n'), std::string::npos) << what << ": " << to_string(problem);
    EXPECT_LT(problem.text.size(), 400U) << what << ": " << to_string(problem);
  }
  EXPECT_TRUE(any_error) << what;
}

TEST(DamagedConfig, CutAtEveryByte) {
  for (std::size_t size = 0; size < good_config.size(); ++size) {
    expect_sane(good_config.substr(0, size), "first " + std::to_string(size) + " bytes");
  }
}

TEST(DamagedConfig, WithoutEachLine) {
  for (std::size_t begin = 0; begin < good_config.size();) {
    const std::size_t end = good_config.find('\n', begin) + 1;
    expect_sane(good_config.substr(0, begin) + good_config.substr(end),
                "without " + good_config.substr(begin, end - begin));
    begin = end;
  }
}

TEST(DamagedConfig, WithEachByteChanged) {
  // Two each, in turn: all for all would take long under sanitizers.
  constexpr std::string_view odd{"\0\n:[*\"{-\xff", 9};
  for (std::size_t at = 0; at < good_config.size(); ++at) {
    for (const std::size_t pick : {at % odd.size(), (at + 4) % odd.size()}) {
      std::string text = good_config;
      text[at] = odd[pick];
      expect_sane(text, "byte " + std::to_string(at) + " is " + std::to_string(odd[pick]));
    }
  }
}

TEST(DamagedConfig, WithOddValues) {
  for (std::size_t line = 0; line < good_config.size(); line = good_config.find('\n', line) + 1) {
    const std::size_t colon = good_config.find(": ", line);
    const std::size_t end = good_config.find('\n', line);
    if (colon == std::string::npos || colon > end) {
      continue;
    }
    for (const char* odd : {"",
                            "~",
                            "null",
                            "-1",
                            "0",
                            "1e999",
                            "18446744073709551616",
                            "0xffffffffffffffffff",
                            "nan",
                            ".inf",
                            "''",
                            "\"\\0\"",
                            "[]",
                            "{}",
                            "[[1]]",
                            "{a: b}",
                            "*x",
                            "&x 1",
                            "!!binary abc",
                            "!!int x",
                            "? x",
                            "|\n  x",
                            ">",
                            "\xff\xfe",
                            "99999999999999999999 s",
                            "-5 ms",
                            "%",
                            "@",
                            "`"}) {
      expect_sane(good_config.substr(0, colon + 2) + odd + good_config.substr(end),
                  good_config.substr(line, colon - line) + ": " + odd);
    }
  }
}

// What follows must also come to an end soon: the time limit of the test is the assertion.

TEST(DamagedConfig, NestedDeeply) {
  for (const char* nest : {"[", "{a: ", "- ", "? ", "{[", "&a [", "a:\n ", "!x [", "\"\\x", "'", "|\n"}) {
    std::string text;
    while (text.size() < 100'000) {
      text += nest;
    }
    expect_sane(text, nest);
  }
  std::string indented;
  for (int depth = 0; depth < 1000; ++depth) {
    indented += std::string(static_cast<std::size_t>(depth), ' ') + "a:\n";
  }
  expect_sane(indented, "indented");
}

TEST(DamagedConfig, WithAnchorsThatMultiply) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 30; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int j = 0; j < 10; ++j) {
      bomb += before + ", ";
    }
    bomb += "]\n";
  }
  expect_sane(bomb, "unknown keys");
  expect_sane(bomb + "routes: *a29\nsomeip: *a29\n", "routes");
  expect_sane(
      replaced(bomb, "x, x", "{topic: /x}, x") + "routes: [<<: *a29, {<<: *a29}, {<<: [*a29, *a28]}]\n",
      "merged");
}

TEST(DamagedConfig, WithMergesThatMultiply) {
  std::string bomb = "routes:\n  - &m0 {topic: /a}\n";
  for (int i = 1; i < 300; ++i) {
    bomb += fmt::format("  - &m{0} {{<<: [*m{1}, *m{1}, *m{1}]}}\n", i, i - 1);
  }
  expect_sane(bomb, "merges");
  expect_sane("routes:\n  - &a {<<: *a}\n  - &b {<<: [*a, *b, *b]}\n", "circles");
}

TEST(DamagedConfig, WithManyKeys) {
  std::string same;
  std::string different;
  for (int i = 0; i < 50'000; ++i) {
    same += "k: v\n";
    different += "k" + std::to_string(i) + ": v\n";
  }
  expect_sane(same, "one key");
  expect_sane(different, "many keys");
  std::string in_one_line = different;
  std::ranges::replace(in_one_line, '\n', ',');
  expect_sane("routes: [{" + in_one_line + "}]\n", "in a route");
}

TEST(DamagedConfig, WithManyRoutes) {
  std::string text = "someip: {address: 127.0.0.1}\nroutes:\n";
  for (int i = 0; i < 2000; ++i) {
    text +=
        "  - {topic: /a, type: a/msg/B, direction: dds_to_someip, service: 1, instance: 1, eventgroup: 1, "
        "event: 1, port: 1}\n";
  }
  const auto loaded = parse_config(text, "b.yaml");
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().size(),
            1000U + 2 * 999U + 1);  // warnings, conflicts with the first, too many
}

}  // namespace
}  // namespace trestle::test::damage_test
