#include "bridge/conform/case.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/profile.hpp"
#include "bridge/conform/stimulus.hpp"

namespace trestle::conform::case_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Cases, HaveIdsOfTheirOwnAndSayWhatTheyAreAbout) {
  std::set<std::string> ids;
  for (const Case& one : all_cases()) {
    EXPECT_TRUE(ids.insert(one.id).second) << one.id << " is there twice";
    EXPECT_GE(std::ranges::count(one.id, '.'), 1) << one.id;
    EXPECT_TRUE(std::ranges::all_of(one.id, [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-';
    })) << one.id;
    EXPECT_FALSE(one.title.empty()) << one.id;
    EXPECT_FALSE(one.requirements.empty()) << one.id;
    EXPECT_TRUE(one.run) << one.id;
    for (const RequirementId& id : one.requirements) {
      const RequirementRow* row = find_requirement(id.text());
      ASSERT_NE(row, nullptr) << id.text();
      EXPECT_FALSE(row->summary.empty()) << id.text();
    }
    for (const Tc8Id& id : one.tc8) {
      ASSERT_NE(find_tc8(id.text()), nullptr) << id.text();
    }
  }
}

TEST(Catalogue, HasAllRows) {
  EXPECT_EQ(requirements().size(), 543U);
  EXPECT_EQ(tc8_cases().size(), 230U);
  ASSERT_NE(find_requirement("feat_req_someipsd_26"), nullptr);
  // A field in quotes, with commas.
  EXPECT_EQ(find_requirement("feat_req_someipsd_26")->summary,
            "SD header: FFFF/8100, client 0 (or prefix), session from 1 per relation, 01/01/02/00.");
  EXPECT_EQ(find_tc8("SOMEIPSRV_FORMAT_01")->expected, "Client ID 0x0000 in its SD messages");
  EXPECT_EQ(find_tc8("SOMEIPSRV_FORMAT_99"), nullptr);
}

TEST(Catalogue, HasACaseForEachOfTc8OrTheReasonWhyNot) {
  std::set<std::string_view> with_case;
  for (const Case& one : all_cases()) {
    for (const Tc8Id& id : one.tc8) {
      with_case.insert(id.text());
    }
  }
  for (const Tc8Row& row : tc8_cases()) {
    EXPECT_EQ(row.why_no_case.empty(), with_case.contains(row.id)) << row.id << ": " << row.why_no_case;
  }
}

Case sample() {
  return {.id = "sd.offer.ttl",
          .title = "offers",
          .level = Level::should,
          .requirements = {"feat_req_someipsd_253"},
          .tc8 = {"SOMEIPSRV_FORMAT_17"}};
}

TEST(Selector, IsAnIdItsStartAPatternOrAnotherId) {
  for (const char* selector : {"sd", "sd.offer", "sd.offer.ttl", "*.ttl", "sd.*.ttl", "*",
                               "SOMEIPSRV_FORMAT_17", "feat_req_someipsd_253"}) {
    EXPECT_TRUE(chosen(sample(), selector)) << selector;
  }
  for (const char* selector : {"s", "sd.off", "sd.offer.ttl.x", "*.tt", "SOMEIPSRV_FORMAT_1", "ttl", ""}) {
    EXPECT_FALSE(chosen(sample(), selector)) << selector;
  }
}

TEST(Selector, KeepsToTheLevel) {
  const std::vector<Case> cases{sample()};
  EXPECT_THAT(choose(cases, {}, Level::must), IsEmpty());
  EXPECT_THAT(choose(cases, {}, Level::should), ElementsAre(&cases.front()));
  EXPECT_THAT(choose(cases, {"rpc"}, Level::tc8), IsEmpty());
}

TEST(Need, OfACaseMakesItUnsupportedWithTheReason) {
  Profile profile;
  profile.services.push_back({.service = someip::ServiceId{1}, .udp_port = std::uint16_t{30501}});
  Case one = sample();
  EXPECT_EQ(unsupported(one, profile), std::nullopt);
  one.needs = Need::tcp | Need::udp;
  EXPECT_EQ(unsupported(one, profile), "the service has no TCP port");
  profile.services.front().tcp_port = std::uint16_t{30501};
  EXPECT_EQ(unsupported(one, profile), std::nullopt);
  one.needs = Need::restart;
  EXPECT_TRUE(unsupported(one, profile));
  profile.lifecycle.start = "device";
  EXPECT_EQ(unsupported(one, profile), std::nullopt);
}

TEST(Need, OfSegmentsIsMetByWhatIsLargeInEachDirection) {
  Profile profile;
  profile.services.push_back({.service = someip::ServiceId{1}, .udp_port = std::uint16_t{30501}});
  LargeProfile& large = profile.services.front().large;
  Case takes = sample();
  takes.needs = Need::large_request;
  Case sends = sample();
  sends.needs = Need::large_message;
  EXPECT_TRUE(unsupported(takes, profile));
  EXPECT_TRUE(unsupported(sends, profile));
  large.request = someip::MethodId{2};
  EXPECT_FALSE(unsupported(takes, profile));
  EXPECT_TRUE(unsupported(sends, profile));
  large = {.response = RequestProfile{.method = someip::MethodId{3}}};
  EXPECT_TRUE(unsupported(takes, profile));
  EXPECT_FALSE(unsupported(sends, profile));
  large = {.echo = someip::MethodId{1}};
  EXPECT_FALSE(unsupported(takes, profile));
  EXPECT_FALSE(unsupported(sends, profile));
  // The Enhanced Testability Service has one that is known.
  large = {};
  profile.tp = true;
  EXPECT_TRUE(unsupported(takes, profile));
  profile.ets = true;
  EXPECT_FALSE(unsupported(takes, profile));
  EXPECT_FALSE(unsupported(sends, profile));
}

TEST(Need, OfProtectionIsMetByMethodsOrByEvents) {
  Profile profile;
  profile.services.push_back({.service = someip::ServiceId{1}, .udp_port = std::uint16_t{30501}});
  Case calls = sample();
  calls.needs = Need::e2e;
  Case listens = sample();
  listens.needs = Need::e2e_event;
  EXPECT_TRUE(unsupported(calls, profile));
  EXPECT_TRUE(unsupported(listens, profile));
  profile.services.front().e2e = {{.id = someip::MethodId{0x8001}}};
  EXPECT_TRUE(unsupported(calls, profile));
  EXPECT_FALSE(unsupported(listens, profile));
  profile.services.front().e2e = {{.id = someip::MethodId{1}}};
  EXPECT_FALSE(unsupported(calls, profile));
  EXPECT_TRUE(unsupported(listens, profile));
}

TEST(Stimulus, IsRightUnlessItIsToBeWrong) {
  SdStimulus find{.entries = {{.service = someip::ServiceId{0x1234},
                               .instance = someip::InstanceId{1},
                               .major = 0xff,
                               .ttl_s = 3,
                               .tail = 0xffff'ffff}},
                  .flags = 0x40};
  EXPECT_EQ(
      find.encode(someip::SessionId{7}, true),
      bytes({0xff, 0xff, 0x81, 0x00, 0,    0,    0, 36, 0,    0, 0, 7, 1,    1,    2,    0,  // header
             0xc0, 0,    0,    0,    0,    0,    0, 16,  // flags, length of the entries
             0,    0,    0,    0,    0x12, 0x34, 0, 1,  0xff, 0, 0, 3, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0}));
  find.entries_length = 8;
  find.length = 20;
  find.uncounted_tail = bytes({9});
  const Bytes wrong = find.encode(someip::SessionId{7}, false);
  EXPECT_EQ(wrong[7], std::byte{20});
  EXPECT_EQ(wrong[16], std::byte{0x40});
  EXPECT_EQ(wrong[23], std::byte{8});
  EXPECT_EQ(wrong.back(), std::byte{9});
}

TEST(Stimulus, NamesAnEndpoint) {
  EXPECT_EQ(endpoint_option({IpAddress::v4(192, 0, 2, 1), 0x1234}, Transport::udp),
            bytes({0, 9, 4, 0, 192, 0, 2, 1, 0, 0x11, 0x12, 0x34}));
}

}  // namespace
}  // namespace trestle::conform::case_test
