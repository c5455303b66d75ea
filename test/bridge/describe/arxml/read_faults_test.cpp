#include <gmock/gmock.h>

#include "test/bridge/describe/arxml/arxml_text.hpp"

namespace trestle::describe {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;

// --- what is wrong ----------------------------------------------------------------------------------------

TEST(ReadArxml, RefusesWhatIsNoXmlOrNoArxml) {
  EXPECT_THAT(
      problems_of(read_texts({""})),
      HasSubstr("0.arxml:1:1: error: the file is empty, and XML with the top element AUTOSAR was expected"));
  EXPECT_THAT(problems_of(read_texts({"<a>\n<b></a>"})),
              HasSubstr("0.arxml:1:1: error: the top element is a"));
  EXPECT_THAT(problems_of(read_texts({std::string{arxml_head} + "\n  <AR-PACKAGES></AR-PACKAGE>"})),
              HasSubstr("error: this tag ends another element, and the end of AR-PACKAGES, which begins on "
                        "line 3, was expected"));
  const std::string whole = arxml(service(""));
  const std::size_t end_of_name = whole.find("</SHORT-NAME>");
  EXPECT_THAT(problems_of(read_texts({whole.substr(0, end_of_name)})),
              ContainsRegex("error: the file ends here, and the end of SHORT-NAME, which begins on line "
                            "[0-9]+, was expected"));
  EXPECT_THAT(problems_of(read_texts({whole.substr(0, end_of_name + 5)})),
              HasSubstr("error: the file ends within the tag or comment that begins here"));
  EXPECT_THAT(
      problems_of(read_texts({"package car\n"})),
      ContainsRegex("0.arxml:1:1: error: this is not well-formed XML: .*; the top element AUTOSAR was "
                    "expected"));
  EXPECT_THAT(problems_of(read_texts({whole + "more"})), HasSubstr("junk after document element"));
  EXPECT_THAT(problems_of(read_texts({"<AUTOSAR xmlns=\"http://autosar.org/3.2.1\"/>"})),
              HasSubstr("http://autosar.org/schema/r4.0 was expected"));
}

TEST(ReadArxml, RefusesEntityBombsAndDeepFiles) {
  EXPECT_THAT(problems_of(read_texts({"<?xml version=\"1.0\"?>\n<!DOCTYPE a [<!ENTITY x \"yyyyyyyyyy\">\n"
                                      "<!ENTITY z \"&x;&x;&x;&x;&x;&x;\">]><AUTOSAR>&z;</AUTOSAR>"})),
              HasSubstr("0.arxml:2:13: error: ARXML has no DTD, so this one is refused"));
  std::string deep{arxml_head};
  for (int i = 0; i < 10'000; ++i) {
    deep += "<AR-PACKAGES>";
  }
  EXPECT_THAT(problems_of(read_texts({deep})), HasSubstr("error: elements are nested more than"));
}

TEST(ReadArxml, RefusesMoreThanItsLimits) {
  EXPECT_THAT(problems_of(read_texts({arxml(base_types)}, {.max_elements = 5})),
              HasSubstr("error: there are more than 5 elements"));
  EXPECT_THAT(problems_of(read_texts({arxml(base_types)}, {.max_text_bytes = 5})),
              HasSubstr("error: there are more than 5 bytes of text"));
  EXPECT_THAT(problems_of(read_texts({arxml(service(""))}, {.max_name_bytes = 3})),
              ContainsRegex("error: this SHORT-NAME has [0-9]+ bytes; expected at most 3"));
}

/// Expat tells nothing of a tag before its end. The reader looks how much is untold with each piece of a
/// file.
TEST(ReadArxml, RefusesTagsAndCommentsWithoutEnd) {
  const std::string filler(1'000'000, 'x');
  for (const std::string& tag : {"<!--" + filler + "-->", "<SERVICE-INTERFACE UUID=\"" + filler + "\"/>",
                                 "<?x " + filler + "?>", "<!--" + filler}) {
    EXPECT_THAT(problems_of(read_texts({arxml("\n" + tag)}, {.max_tag_bytes = 100'000})),
                HasSubstr("0.arxml:3:1: error: this tag or comment has more than 100000 bytes, or does not "
                          "end; expected shorter ones"))
        << tag.substr(0, 10);
  }
  // Many of them, and text, may be as long as they like.
  std::string many;
  for (int i = 0; i < 20; ++i) {
    many += "<!--" + filler.substr(0, 50'000) + "-->";
  }
  EXPECT_EQ(problems_of(read_texts({arxml(many + "<X>" + filler + "</X>")}, {.max_tag_bytes = 400'000})), "");
}

TEST(ReadArxml, LeavesAnInstanceIdOpenThatIsNone) {
  for (const std::string id : {"0", "65535"}) {
    const Reading reading = read_texts(
        {arxml(service("") +
               "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME>"
               "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
               "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
               "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Left</SHORT-NAME>"
               "<SERVICE-INTERFACE-DEPLOYMENT-REF DEST=\"X\">/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF>"
               "<SERVICE-INSTANCE-ID>" +
               id + "</SERVICE-INSTANCE-ID></PROVIDED-SOMEIP-SERVICE-INSTANCE>")});
    EXPECT_TRUE(reading.ok());
    EXPECT_THAT(problems_of(reading),
                HasSubstr("warning: " + id + " cannot be the id of an instance: it is left open"));
    ASSERT_EQ(reading.model.instances.size(), 1U);
    EXPECT_EQ(reading.model.instances[0].id, std::nullopt);
  }
}

TEST(ReadArxml, WarnsOfWhatIsNotByTheSchema) {
  const Reading reading = read_texts(
      {arxml(service("<VARIATION-POINT/><FIELDS><FIELD><SHORT-NAME>f</SHORT-NAME><TYPE-TREF "
                     "DEST=\"X\">/x/uint8</TYPE-TREF>"
                     "</FIELD></FIELDS>") +
             "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</"
             "SHORT-NAME><FIELD-DEPLOYMENTS><SOMEIP-FIELD-DEPLOYMENT>"
             "<SHORT-NAME>d</SHORT-NAME><FIELD-REF "
             "DEST=\"X\">Door/f</FIELD-REF><GETTER><METHOD-ID>1</METHOD-ID></GETTER>"
             "<SETTER><METHOD-ID>2</METHOD-ID></SETTER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS>"
             "<SERVICE-INTERFACE-REF DEST=\"X\"> Door "
             "</SERVICE-INTERFACE-REF><SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID>"
             "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: 1 elements of this file have a VARIATION-POINT"));
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: GETTER is read as GET"));
  EXPECT_THAT(problems_of(reading),
              HasSubstr("warning: \"Door\" is no path from the top; /P/Door was taken"));
  EXPECT_EQ(reading.model.services.at(0).fields.at(0).setter, someip::MethodId{2});
}

}  // namespace
}  // namespace trestle::describe
