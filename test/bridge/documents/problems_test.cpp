#include "bridge/documents/problems.hpp"

#include <gmock/gmock.h>

namespace trestle::documents::problems_test {
namespace {

using testing::ElementsAre;

std::vector<std::string> words(std::vector<Problem> problems) {
  std::vector<std::string> result;
  for (const Problem& problem : problems) {
    result.push_back(to_string(problem));
  }
  return result;
}

TEST(Problems, AreInTheOrderOfFilesAndPlaces) {
  Problems problems{100};
  problems.warning(Place{1, {1, 1}}, "d");
  problems.error(Place{0, {2, 7}}, "c");
  problems.error(Place{0, {2, 3}}, "b");
  problems.warning(Place{0, {1, 9}}, "a");
  problems.error(Place{7, {1, 1}}, "of a file without a name");
  EXPECT_TRUE(problems.has_errors());
  EXPECT_THAT(words(problems.take({"x", "y"})),
              ElementsAre("x:1:9: warning: a", "x:2:3: error: b", "x:2:7: error: c", "y:1:1: warning: d",
                          ":1:1: error: of a file without a name"));
}

TEST(Printable, SpellsOutWhatSteersATerminal) {
  EXPECT_EQ(printable("a\x1b[31m\x7f"), "a\\x1b[31m\\x7f");
  EXPECT_EQ(printable("a\xc2\x9b"
                      "31m"),
            "a\\u009b31m");  // CSI in one character
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "b"),
            "\\u202eb");  // turns the direction of text
  EXPECT_EQ(printable("\x9b"
                      "31m\xc3"),
            "\\x9b31m\\xc3");
  EXPECT_EQ(printable("T\xc3\xbcr"), "T\xc3\xbcr");
  EXPECT_FALSE(has_control("T\xc3\xbcr 1"));
  EXPECT_TRUE(has_control("\xc2\x9b"));
  EXPECT_TRUE(has_control("\xff"));
}

TEST(Printable, KeepsTheMeaningOfJson) {
  EXPECT_EQ(printable_json("{\n  \"a\": \"\xc2\x9b\x7f\"\n}"), "{\n  \"a\": \"\\u009b\\u007f\"\n}");
  EXPECT_EQ(printable_json("\"T\xc3\xbcr\""), "\"T\xc3\xbcr\"");
  EXPECT_EQ(printable_json("\"a\""), "\"a\"");
}

TEST(Printable, QuotesNoHalfCharacters) {
  EXPECT_EQ(quote(std::string(59, 'a') + "\xc3\xbc"), "'" + std::string(59, 'a') + "...'");
}

TEST(Problems, AreOneLineWithoutControlCharacters) {
  EXPECT_EQ(to_string(Problem{.file = "a\x1b", .mark = {1, 2}, .text = "b\nc"}),
            "a\\x1b:1:2: error: b\\x0ac");
}

TEST(Problems, SayTheSameAtOnePlaceOnce) {
  Problems problems{"f"};
  problems.error(Mark{1, 1}, "a");
  problems.error(Mark{1, 1}, "b");
  problems.error(Mark{1, 1}, "a");
  problems.error(Mark{2, 1}, "a");
  EXPECT_THAT(words(problems.take()), ElementsAre("f:1:1: error: a", "f:1:1: error: b", "f:2:1: error: a"));
}

TEST(Problems, KeepErrorsBeforeWarningsWhereThereAreTooMany) {
  Problems problems{"f", 3};
  for (int line = 1; line <= 5; ++line) {
    problems.warning(Mark{line, 1}, "w");
  }
  problems.error(Mark{8, 1}, "a");
  EXPECT_FALSE(problems.full());
  problems.error(Mark{9, 1}, "b");
  problems.error(Mark{10, 1}, "c");
  EXPECT_TRUE(problems.full());
  problems.error(Mark{11, 1}, "d");
  EXPECT_THAT(words(problems.take()), ElementsAre("f:8:1: error: a", "f:9:1: error: b", "f:10:1: error: c"));

  Problems fewer{"f", 3};
  for (int line = 1; line <= 5; ++line) {
    fewer.warning(Mark{line, 1}, "w");
  }
  fewer.error(Mark{8, 1}, "a");
  EXPECT_THAT(words(fewer.take()), ElementsAre("f:1:1: warning: w", "f:2:1: warning: w", "f:8:1: error: a"));
}

TEST(Problems, WarnOnceForEachKey) {
  Problems problems{"f"};
  problems.warning_once("k", Place{0, {1, 1}}, "a");
  problems.warning_once("k", Place{0, {2, 1}}, "b");
  problems.warning_once("l", Place{0, {3, 1}}, "c");
  EXPECT_FALSE(problems.has_errors());
  EXPECT_THAT(words(problems.take()), ElementsAre("f:1:1: warning: a", "f:3:1: warning: c"));
}

}  // namespace
}  // namespace trestle::documents::problems_test
