#include "bridge/carry/config/topic_pattern.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace trestle::test::topic_pattern_test {
namespace {

using carry::is_topic_pattern;
using carry::matches;

struct Case {
  const char* pattern;
  const char* topic;
  bool matches;
};

TEST(TopicPattern, MatchesLevelByLevel) {
  for (const auto& [pattern, topic, expected] : {
           Case{"/a", "/a", true},
           Case{"/a", "/b", false},
           Case{"/a", "/a/b", false},
           Case{"/a/b", "/a", false},
           // Any number of levels, none included.
           Case{"/**", "/a", true},
           Case{"/**", "/a/b/c", true},
           Case{"/sensing/**", "/sensing/imu", true},
           Case{"/sensing/**", "/sensing/lidar/top/points", true},
           Case{"/sensing/**", "/sensing", true},
           Case{"/sensing/**", "/sensings/imu", false},
           Case{"/sensing/**", "/x/sensing/imu", false},
           Case{"/**/points", "/points", true},
           Case{"/**/points", "/a/b/points", true},
           Case{"/**/points", "/a/points/b", false},
           Case{"/a/**/z", "/a/z", true},
           Case{"/a/**/z", "/a/b/c/z", true},
           Case{"/a/**/z", "/a/b/c/y", false},
           Case{"/a/**/m/**/z", "/a/1m/m/b/z", true},
           Case{"/a/**/m/**/z", "/a/b/z", false},
           Case{"/**/**", "/a", true},
           // One level, or a part of it.
           Case{"/*", "/a", true},
           Case{"/*", "/a/b", false},
           Case{"/*/b", "/a/b", true},
           Case{"/*/b", "/b", false},
           Case{"/cam*", "/cam", true},
           Case{"/cam*", "/cam_left", true},
           Case{"/cam*", "/ca", false},
           Case{"/cam*", "/cam/left", false},
           Case{"/*left*", "/cam_left_2", true},
           Case{"/a*b*c", "/abbc", true},
           Case{"/a*b*c", "/abcb", false},
           Case{"/a*b*c", "/acbc", true},
           Case{"/*a", "/baa", true},
           Case{"/cam*/**/image", "/cam1/raw/image", true},
       }) {
    EXPECT_EQ(matches(pattern, topic), expected) << pattern << " " << topic;
  }
}

TEST(TopicPattern, LeavesOutWhatRosHidesUnlessItSaysSo) {
  for (const auto& [pattern, topic, expected] : {
           Case{"/**", "/rosout", false},
           Case{"/*", "/parameter_events", false},
           Case{"/rosout", "/rosout", true},
           Case{"/parameter_events", "/parameter_events", true},
           Case{"/**", "/x/rosout", true},
           Case{"/**", "/move/_action/feedback", false},
           Case{"/move/*/feedback", "/move/_action/feedback", false},
           Case{"/**", "/_hidden", false},
           Case{"/*hidden", "/_hidden", false},
           Case{"/_*", "/_hidden", true},
           Case{"/move/_action/*", "/move/_action/feedback", true},
           Case{"/**/_action/feedback", "/a/move/_action/feedback", true},
       }) {
    EXPECT_EQ(matches(pattern, topic), expected) << pattern << " " << topic;
  }
}

TEST(TopicPattern, HasTheFormOfATopic) {
  for (const char* const good : {"/a", "/*", "/**", "/a/**/b*", "/*_left", "/**/x"}) {
    EXPECT_TRUE(is_topic_pattern(good)) << good;
  }
  for (const char* const bad :
       {"", "a", "**", "/", "/a/", "//a", "/a**", "/**a/b", "/***", "/a b", "/1a", "/a-b", "/?", "/[ab]"}) {
    EXPECT_FALSE(is_topic_pattern(bad)) << bad;
  }
  EXPECT_FALSE(is_topic_pattern("/" + std::string(247, 'a')));
}

// Names come from peers. What is tried again for each star would take longer than anybody lives here.
TEST(TopicPattern, TakesNoLongForAnyName) {
  std::string pattern = "/";
  std::string topic = "/";
  for (int i = 0; i < 100; ++i) {
    pattern += "a*";
    topic += "aa";
  }
  const auto before = std::chrono::steady_clock::now();
  EXPECT_FALSE(matches(pattern + "b", topic));
  std::string levels;
  std::string name;
  for (int i = 0; i < 40; ++i) {
    levels += "/**/a";
    name += "/a/a/a";
  }
  EXPECT_FALSE(matches(levels + "/b", name));
  EXPECT_TRUE(matches(levels, name));
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds{10});
}

}  // namespace
}  // namespace trestle::test::topic_pattern_test
