// End-to-end protection in ARXML of the Adaptive Platform. What is written stands in write_test.cpp, too, and
// others read it in written_test.py.
#include <gmock/gmock.h>

#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "test/bridge/describe/arxml/arxml_text.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;

std::string reference(std::string_view tag, std::string_view path) {
  return "<" + std::string{tag} + " DEST=\"X\">" + std::string{path} + "</" + std::string{tag} + ">";
}

std::string deployed(std::string_view tag, std::string_view name, std::string_view content) {
  return "<" + std::string{tag} + "><SHORT-NAME>" + std::string{name} + "</SHORT-NAME>" +
         std::string{content} + "</" + std::string{tag} + ">";
}

/// A service with the event `moved`, the method `open` and the field `level`, and instances of it.
std::string door(const std::vector<std::string>& protections) {
  std::string text =
      deployed("SERVICE-INTERFACE", "Door",
               "<EVENTS>" + deployed("VARIABLE-DATA-PROTOTYPE", "moved", reference("TYPE-TREF", "/x/uint8")) +
                   "</EVENTS><FIELDS>" + deployed("FIELD", "level", reference("TYPE-TREF", "/x/uint8")) +
                   "</FIELDS><METHODS>" + deployed("CLIENT-SERVER-OPERATION", "open", "") + "</METHODS>") +
      deployed("SOMEIP-SERVICE-INTERFACE-DEPLOYMENT", "Dep",
               "<EVENT-DEPLOYMENTS>" +
                   deployed("SOMEIP-EVENT-DEPLOYMENT", "moved", reference("EVENT-REF", "/P/Door/moved")) +
                   "</EVENT-DEPLOYMENTS><FIELD-DEPLOYMENTS>" +
                   deployed("SOMEIP-FIELD-DEPLOYMENT", "level",
                            reference("FIELD-REF", "/P/Door/level") + deployed("GET", "get", "") +
                                deployed("NOTIFIER", "notify", "") + deployed("SET", "set", "")) +
                   "</FIELD-DEPLOYMENTS><METHOD-DEPLOYMENTS>" +
                   deployed("SOMEIP-METHOD-DEPLOYMENT", "open", reference("METHOD-REF", "/P/Door/open")) +
                   "</METHOD-DEPLOYMENTS>" + reference("SERVICE-INTERFACE-REF", "/P/Door") +
                   "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID>") +
      deployed("E-2-E-PROFILE-COMPATIBILITY-PROPS", "Extended",
               "<TRANSIT-TO-INVALID-EXTENDED>true</TRANSIT-TO-INVALID-EXTENDED>") +
      deployed(
          "E-2-E-PROFILE-CONFIGURATION-SET", "Set",
          "<E-2-E-PROFILE-CONFIGURATIONS>" +
              deployed("E-2-E-PROFILE-CONFIGURATION", "Four",
                       reference("E-2-E-PROFILE-COMPATIBILITY-PROPS-REF", "/P/Extended") +
                           "<MAX-DELTA-COUNTER>3</MAX-DELTA-COUNTER>"
                           "<PROFILE-NAME>PROFILE_04</PROFILE-NAME>") +
              deployed("E-2-E-PROFILE-CONFIGURATION", "FourM", "<PROFILE-NAME>PROFILE_04M</PROFILE-NAME>") +
              deployed("E-2-E-PROFILE-CONFIGURATION", "None", "") + "</E-2-E-PROFILE-CONFIGURATIONS>");
  for (const std::string& one : protections) {
    text +=
        deployed("PROVIDED-SOMEIP-SERVICE-INSTANCE", "Instance" + std::to_string(&one - protections.data()),
                 one + reference("SERVICE-INTERFACE-DEPLOYMENT-REF", "/P/Dep"));
  }
  return arxml(text);
}

std::string protection(std::string_view kind, std::string_view path, std::string_view profile,
                       std::string_view id, std::string_view more = "") {
  const std::string name{kind};
  return "<E-2-E-" + name + "-PROTECTION-PROPSS>" +
         deployed("END-2-END-" + name + "-PROTECTION-PROPS", "E2e",
                  "<DATA-IDS><DATA-ID>" + std::string{id} + "</DATA-ID></DATA-IDS>" + std::string{more} +
                      reference("E-2-E-PROFILE-CONFIGURATION-REF", "/P/Set/" + std::string{profile}) +
                      reference(name + "-REF", path)) +
         "</E-2-E-" + name + "-PROTECTION-PROPSS>";
}

TEST(ProtectionInArxml, IsReadOfEventsMethodsAndEachPartOfAField) {
  const Reading reading = read_texts(
      {door({protection("EVENT", "/P/Dep/moved", "Four", "0x10") +
             protection("EVENT", "/P/Dep/level/notify", "Four", "0x11") +
             protection("METHOD", "/P/Dep/level/get", "FourM", "0x12") +
             protection("METHOD", "/P/Dep/level/set", "FourM", "0x13", "<SOURCE-ID>5</SOURCE-ID>") +
             protection("METHOD", "/P/Dep/open", "FourM", "0x14")})});
  EXPECT_EQ(problems_of(reading), "");
  const Service& service = reading.model.services.at(0);
  const Protection& moved = service.events.at(0).e2e;
  EXPECT_EQ(moved.profile, "4");
  EXPECT_THAT(moved.numbers, ElementsAre(Pair("data_id", 0x10), Pair("max_delta_counter", 3)));
  EXPECT_THAT(moved.words, ElementsAre(Pair("transit_to_invalid_extended", "true")));
  const describe::Field& level = service.fields.at(0);
  EXPECT_EQ(level.e2e.numbers.at("data_id"), 0x11U);
  EXPECT_EQ(level.getter_e2e.profile, "4m");
  EXPECT_THAT(level.getter_e2e.numbers, ElementsAre(Pair("data_id", 0x12)));
  EXPECT_THAT(level.setter_e2e.numbers, ElementsAre(Pair("data_id", 0x13), Pair("source_id", 5)));
  EXPECT_EQ(service.methods.at(0).e2e.numbers.at("data_id"), 0x14U);
}

/// The file has a protection for each instance; what all say is one.
TEST(ProtectionInArxml, IsJoinedOfAllInstances) {
  const Reading reading =
      read_texts({door({protection("EVENT", "/P/Dep/moved", "Four", "1"),
                        protection("EVENT", "/P/Dep/moved", "Four", "1", "<DATA-LENGTH>96</DATA-LENGTH>")})});
  EXPECT_EQ(problems_of(reading), "");
  EXPECT_EQ(reading.model.services.at(0).events.at(0).e2e.numbers.at("data_bits"), 96U);
  const auto two = [](std::string_view profile, std::string_view id) {
    return problems_of(read_texts({door({protection("EVENT", "/P/Dep/moved", "Four", "1"),
                                         protection("EVENT", "/P/Dep/moved", profile, id)})}));
  };
  EXPECT_THAT(two("Four", "2"), HasSubstr("warning: /P/Instance1/E2e has another data_id than another "
                                          "instance of the service: what was read first is taken"));
  EXPECT_THAT(two("FourM", "1"), HasSubstr("/P/Instance1/E2e has another PROFILE-NAME than"));
}

/// What an instance has, which is given an id.
std::string of_instance(std::string_view id, const std::string& protections) {
  return protections + "<SERVICE-INSTANCE-ID>" + std::string{id} + "</SERVICE-INSTANCE-ID>";
}

TEST(ProtectionInArxml, IsThatOfAnInstanceWhereItDiffers) {
  const auto of = [](std::string_view instance, std::string_view id, std::string_view more = "") {
    return of_instance(instance, protection("EVENT", "/P/Dep/moved", "Four", id, more));
  };
  const Reading reading =
      read_texts({door({of("1", "1"), of("2", "2", "<DATA-LENGTH>80</DATA-LENGTH>"),
                        of("3", "1", "<DATA-LENGTH>96</DATA-LENGTH>"), of("4", "1</DATA-ID><DATA-ID>2"),
                        // Who wants any instance says what holds for all that say nothing else.
                        of("ANY", "2", "<MAX-DATA-LENGTH>800</MAX-DATA-LENGTH>")})});
  EXPECT_EQ(problems_of(reading), "");
  const Protection& e2e = reading.model.services.at(0).events.at(0).e2e;
  const auto numbers = [&](std::uint16_t instance) { return e2e.of(someip::InstanceId{instance}).numbers; };
  EXPECT_THAT(e2e.numbers,
              ElementsAre(Pair("data_bits", 96), Pair("data_id", 1), Pair("max_delta_counter", 3)));
  EXPECT_EQ(numbers(1), e2e.numbers);
  EXPECT_EQ(numbers(3), e2e.numbers);
  EXPECT_EQ(&e2e.of(someip::any_instance), &e2e);
  EXPECT_EQ(&e2e.of(std::nullopt), &e2e);
  EXPECT_THAT(numbers(2), ElementsAre(Pair("data_bits", 80), Pair("data_id", 2), Pair("max_data_bits", 800),
                                      Pair("max_delta_counter", 3)));
  EXPECT_EQ(e2e.of(someip::InstanceId{4}).words.at("data_id_list"), "1 2");
  EXPECT_EQ(e2e.of_instances.size(), 2U);
}

TEST(ProtectionInArxml, CannotBeTwoOfOneInstance) {
  const auto of = [](std::string_view instance, std::string_view id) {
    return of_instance(instance, protection("EVENT", "/P/Dep/moved", "Four", id));
  };
  const auto told = [](const std::vector<std::string>& instances) {
    return problems_of(read_texts({door(instances)}));
  };
  EXPECT_THAT(told({of("1", "1"), of("2", "2"), of("2", "3")}),
              HasSubstr("warning: /P/Instance2/E2e has another data_id than is said of the same instance "
                        "elsewhere: what was read first is taken"));
  EXPECT_THAT(told({of("1", "1"), of("2", "2"), of("ANY", "3")}),
              HasSubstr("warning: /P/Instance2/E2e has another data_id than another instance of the service: "
                        "what was read first is taken, as its instance has no id"));
}

TEST(ProtectionInArxml, IsNotLeftOutWithoutAWord) {
  EXPECT_THAT(problems_of(read_texts({door({protection("EVENT", "/P/Dep/gone", "Four", "1")})})),
              HasSubstr("warning: /P/Instance0/E2e is left out: its EVENT-REF is missing, or names nothing"));
  for (const char* const profile : {"None", "Gone"}) {
    EXPECT_THAT(problems_of(read_texts({door({protection("METHOD", "/P/Dep/open", profile, "1")})})),
                HasSubstr("warning: /P/Instance0/E2e is left out: the profile that it refers to has no "
                          "PROFILE-NAME, or is in none of the files"))
        << profile;
  }
}

/// An event and a method with protection, and an instance.
Model protected_door(Protection event, Protection method = {}) {
  Model model;
  model.services = {{.name = "Door", .scope = "/car", .id = someip::ServiceId{1}}};
  model.services[0].events = {{.name = "moved", .id = someip::MethodId{0x8001}, .e2e = std::move(event)}};
  model.services[0].methods = {{.name = "open", .id = someip::MethodId{1}, .e2e = std::move(method)}};
  model.instances = {{.name = "Left", .service = "/car/Door", .service_id = someip::ServiceId{1}}};
  return model;
}

TEST(ProtectionInArxml, ListsWhatAutosarHasNoElementFor) {
  const ArxmlFile file = write_arxml(
      protected_door({.profile = "5",
                      .numbers = {{"data_bits", 96}, {"data_id", 1}, {"offset_bits", 72}, {"source_id", 3}},
                      .words = {{"crc_order", "big"}, {"data_id_mode", "odd"}}},
                     {.profile = "1",
                      .numbers = {{"crc_offset_bits", 64}, {"data_id", 2}, {"max_delta_counter_init", 3}},
                      .words = {{"behavior", "pre_r4_2"}}}));
  EXPECT_THAT(lines_of(file.not_carried), ElementsAre("Door.moved: its E2E protection: crc_order is big",
                                                      "Door.moved: its E2E protection: data_id_mode is odd",
                                                      "Door.moved: its E2E protection: offset_bits is 72",
                                                      "Door.moved: its E2E protection: source_id is 3",
                                                      "Door.open: its E2E protection: behavior is pre_r4_2"));
  const Reading reading = read_texts({file.text});
  EXPECT_EQ(problems_of(reading), "");
  // As e2e_yaml() takes it, for profiles 1 and 2 it is the same.
  EXPECT_EQ(reading.model.services.at(0).methods.at(0).e2e.numbers.at("max_delta_counter"), 3U);
}

TEST(ProtectionInArxml, IsListedWhereNoInstanceCanHaveIt) {
  Model model = protected_door({.profile = "4", .numbers = {{"data_id", 1}}});
  model.instances.clear();
  ArxmlFile file = write_arxml(model);
  EXPECT_THAT(lines_of(file.not_carried),
              ElementsAre("Door.moved: its E2E protection: its service has no instance"));
  EXPECT_THAT(file.text, Not(HasSubstr("E-2-E")));
  model.services[0].id.reset();  // so that it is not even deployed
  EXPECT_EQ(lines_of(write_arxml(model).not_carried), lines_of(file.not_carried));
  const Model odd = protected_door({.profile = "4 & more", .numbers = {{"data_id", 1}}});
  EXPECT_THAT(lines_of(write_arxml(odd).not_carried),
              ElementsAre("Door.moved: its E2E protection: profile is 4 & more"));
}

TEST(ProtectionInArxml, IsWrittenAsEachInstanceHasIt) {
  Model model = protected_door({.profile = "4", .numbers = {{"data_id", 1}}, .words = {{"crc_order", "big"}}},
                               {.profile = "4m", .numbers = {{"data_id", 2}}});
  Service& service = model.services[0];
  service.events[0].e2e.set(someip::InstanceId{2},
                            {.profile = "4", .numbers = {{"data_id", 3}}, .words = {{"crc_order", "big"}}});
  service.methods[0].e2e.set(someip::InstanceId{2}, {.profile = "22", .words = {{"data_id_list", "1 2 3"}}});
  service.methods[0].e2e.set(someip::InstanceId{3}, {});
  for (const std::uint16_t id : {std::uint16_t{2}, std::uint16_t{3}}) {
    model.instances.push_back(model.instances[0]);
    model.instances.back().name = "I" + std::to_string(id);
    model.instances.back().id = someip::InstanceId{id};
  }
  model.instances[0].id = someip::InstanceId{1};
  const ArxmlFile file = write_arxml(model);
  EXPECT_THAT(lines_of(file.not_carried), ElementsAre("Door.moved: its E2E protection: crc_order is big"));
  const Reading reading = read_texts({file.text});
  EXPECT_EQ(problems_of(reading), "");
  const Service& read = reading.model.services.at(0);
  const Protection& moved = read.events.at(0).e2e;
  EXPECT_EQ(moved.of(someip::InstanceId{1}).numbers.at("data_id"), 1U);
  EXPECT_EQ(moved.of(someip::InstanceId{2}).numbers.at("data_id"), 3U);
  EXPECT_EQ(moved.of(someip::InstanceId{3}).numbers.at("data_id"), 1U);
  const Protection& open = read.methods.at(0).e2e;
  EXPECT_EQ(open.of(someip::InstanceId{1}).numbers.at("data_id"), 2U);
  EXPECT_EQ(open.of(someip::InstanceId{2}).profile, "22");
  EXPECT_EQ(open.of(someip::InstanceId{2}).words, service.methods[0].e2e.of(someip::InstanceId{2}).words);
  // Two have it of the event, and one of the method has none.
  std::size_t methods = 0;
  for (std::size_t at = 0; (at = file.text.find("<METHOD-REF", at)) != std::string::npos; ++at) {
    ++methods;
  }
  EXPECT_EQ(methods, 3U) << "the deployment, and two instances";
  model.instances.pop_back();
  model.instances.pop_back();
  EXPECT_THAT(
      lines_of(write_arxml(model).not_carried),
      ElementsAre(
          "Door.moved: its E2E protection: crc_order is big",
          "Door.moved: its E2E protection in instance 0x0002 data_id 0x0003: there is no such instance",
          "Door.open: its E2E protection in instance 0x0002 profile 22, data_id_list 1 2 3; in "
          "instance 0x0003 none: there is no such instance"));
}

TEST(ProtectionInArxml, HasABound) {
  Model model = protected_door({.profile = "4", .numbers = {{"data_id", 1}}});
  Service& service = model.services[0];
  const Event event = service.events[0];
  service.events.clear();
  constexpr unsigned many = 1000;
  for (unsigned i = 0; i < many; ++i) {
    service.events.push_back(event);
    service.events.back().name = "e" + std::to_string(i);
    service.events.back().id = static_cast<someip::MethodId>(0x8001U + i);
  }
  model.instances.resize(300, model.instances[0]);
  for (std::size_t i = 0; i < model.instances.size(); ++i) {
    model.instances[i].name = "I" + std::to_string(i);
  }
  const ArxmlFile file = write_arxml(model);
  EXPECT_LT(file.text.size(), 200'000'000U);
  EXPECT_EQ(file.not_carried.size(), 100U);
  EXPECT_EQ(lines_of(file.not_carried).back(),
            "I299: the E2E protection of its elements: there are too many");
}

}  // namespace
}  // namespace trestle::describe
