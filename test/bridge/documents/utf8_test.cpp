#include "bridge/documents/utf8.hpp"

#include <gtest/gtest.h>

namespace trestle::documents {
namespace {

TEST(MakeUtf8, TakesOtherBytesAsWindows1252AndSaysWhereTheFirstIs) {
  std::string text =
      "a\nGr\xf6\xdf"
      "e \x80 \x81";
  EXPECT_EQ(make_utf8(text), (Mark{2, 3}));
  EXPECT_EQ(text,
            "a\nGr\xc3\xb6\xc3\x9f"
            "e \xe2\x82\xac \xc2\x81");
  std::string again = "\xe9";
  const auto problem = make_utf8(again, "Door.fidl");
  ASSERT_TRUE(problem);
  EXPECT_EQ(to_string(*problem),
            "Door.fidl:1:1: warning: here the file is not UTF-8: such bytes are taken as Windows-1252 (ISO "
            "8859-1)");
}

TEST(MakeUtf8, KeepsCharactersThatAreUtf8BesideThem) {
  std::string text = "\xef\xbb\xbf\xc3\xb6 \xf6";
  EXPECT_EQ(make_utf8(text), (Mark{1, 4})) << "the byte order mark is not counted";
  EXPECT_EQ(text, "\xef\xbb\xbf\xc3\xb6 \xc3\xb6");
}

TEST(MakeUtf8, LeavesUtf8AndUtf16AsTheyAre) {
  for (const std::string& text : {std::string{}, std::string{"abc"}, std::string{"\xef\xbb\xbf\xe2\x82\xac"},
                                  std::string{"\xff\xfe"
                                              "a\0\xf6\0",
                                              6},
                                  std::string{"\xfe\xff\0\xf6", 4}}) {
    std::string same = text;
    EXPECT_EQ(make_utf8(same), std::nullopt);
    EXPECT_EQ(same, text);
  }
}

}  // namespace
}  // namespace trestle::documents
