#include "bridge/documents/xml_text.hpp"

#include <gtest/gtest.h>

namespace trestle::documents::xml_text_test {
namespace {

TEST(XmlText, IsReadAsItWas) {
  EXPECT_EQ(xml_text("a < b && \"c\" > d\r\n\te"), "a &lt; b &amp;&amp; &quot;c&quot; &gt; d\r\n\te");
  EXPECT_EQ(xml_text("Größe"), "Größe");
}

TEST(XmlText, HasNoCharacterThatXmlCannotHave) {
  EXPECT_EQ(xml_text(std::string_view{"a\0b\x1b[31m", 8}), "a?b?[31m");
}

}  // namespace
}  // namespace trestle::documents::xml_text_test
