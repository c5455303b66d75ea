#include <gmock/gmock.h>

#include "bridge/describe/write/sheet/write_sheet.hpp"

namespace trestle::describe {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

Written written_sheet() {
  Model model;
  const TypeIndex side =
      model.add({.kind = Kind::enumeration,
                 .name = "Side",
                 .scope = "org.example",
                 .primitive = messages::Primitive::uint16,
                 .enumerators = {{.name = "LEFT", .value = 3, .notes = {.description = "a|b <x>"}}}});
  model.add({.kind = Kind::primitive,
             .name = "Percent",
             .invalid_value = 255,
             .minimum = 0,
             .maximum = 100,
             .notes = {.unit = "%"}});
  model.services.push_back({.name = "Door",
                            .scope = "org.example",
                            .id = someip::ServiceId{0x1234},
                            .major = 2,
                            .methods = {{.name = "open",
                                         .id = someip::MethodId{1},
                                         .request = {.values = {{.name = "side",
                                                                 .type = side,
                                                                 .notes = {.description = "Which one",
                                                                           .unit = "m",
                                                                           .others = {{"@see", "b"}}}}}},
                                         .notes = {.description = "Opens & closes"}}},
                            .fields = {{.name = "speed",
                                        .payload = {.values = {{.name = "speed", .type = side}}},
                                        .notifier = someip::MethodId{0x8001},
                                        .has_setter = false,
                                        .eventgroups = {someip::EventgroupId{7}}}},
                            .eventgroups = {{.name = "all", .id = someip::EventgroupId{7}}}});
  model.instances.push_back({.name = "front",
                             .service = "org.example.Door",
                             .id = someip::InstanceId{1},
                             .address = IpAddress::v4(10, 0, 0, 1),
                             .udp_port = std::uint16_t{30501}});
  return write_sheet(model);
}

TEST(WriteSheet, HasTheLayoutOfEachPayload) {
  const Written written = written_sheet();
  ASSERT_THAT(written.files, SizeIs(2));
  const std::string& text = written.files[0].text;
  for (const char* part :
       {"# Interfaces\n", "\n## org.example.Door (0x1234, version 2.0)\n",
        "| front | 0x0001 | provided | 10.0.0.1 | 30501 |  |\n", "| all | 0x0007 | speed |  |\n",
        "\n### Method open (0x0001)\n\nOpens & closes\n\nRequest: UDP\n",
        "| offset | bytes | field | type | rule |\n| --- | --- | --- | --- | --- |\n| 0 | 2 | side | Side | "
        "big endian |\n\n| value | unit | meaning |\n| --- | --- | --- |\n| side | m | Which one; see: b "
        "|\n",
        "\nResponse: UDP, empty\n", "### Field speed (getter ?, notifier 0x8001)",
        "\n### org.example.Side (enumeration)\n",
        "\nA uint8 from 0 to 100, unit %. 255 means that there is no value.\n",
        "| LEFT | 3 | a\\|b \\<x> |\n"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(WriteSheet, HasTheSettingsOfMembersAndInstances) {
  using namespace std::chrono_literals;
  Model model;
  Service door{.name = "Door", .id = someip::ServiceId{1}, .base = "car.Base"};
  door.methods = {{.name = "play", .id = someip::MethodId{0x20}, .selector = "slow", .timeout = 5ms},
                  {.name = "play", .id = someip::MethodId{0x21}, .selector = "fast", .observed_bytes = 77U}};
  door.methods[0].request_transfer = {
      .segment_bytes = 160, .separation = 300us, .debounce = 2ms, .retention = 4ms};
  door.events = {{.name = "moved",
                  .id = someip::MethodId{0x8001},
                  .eventgroups = {someip::EventgroupId{7}},
                  .selective = true,
                  .selector = "far",
                  .cycle = 20ms}};
  door.eventgroups = {{.id = someip::EventgroupId{7}}};
  model.services = {door};
  model.machines = {{.name = "Ecu",
                     .address = IpAddress::v4(10, 0, 0, 1),
                     .sd_multicast = IpAddress::v4(224, 0, 0, 1),
                     .sd_port = std::uint16_t{30490}}};
  for (const std::uint16_t id : {std::uint16_t{1}, std::uint16_t{2}}) {
    model.instances.push_back(
        {.service = "Door",
         .id = someip::InstanceId{id},
         .multicast = {{.eventgroup = someip::EventgroupId{7},
                        .group = {IpAddress::v4(239, 0, 0, static_cast<std::uint8_t>(id)), 1000},
                        .threshold = id}}});
  }
  model.instances[0].timing = sd::Timing{.ttl_s = 99};
  model.instances[0].machine = "Ecu";
  const std::string text = write_sheet(model).files[0].text;
  for (const char* part :
       {"\nIt extends car.Base.\n", "\n### Method play:slow (0x0020)\n\nTimeout: 5 ms.\n",
        "\nRequest: UDP, SOME/IP-TP with segments of 160 bytes, 300 us between segments, collected at least "
        "2 ms "
        "apart for at most 4 ms, empty\n",
        "\n### Method play:fast (0x0021)\n\nThe largest payload seen has 77 bytes.\n",
        "\n### Event moved:far (0x8001)\n\nSelective: the service chooses who gets it.\n\nCycle: 20 ms.\n",
        "|  | 0x0007 | moved:far | Door 0x0001: 239.0.0.1:1000 from 1 subscribers on; Door 0x0002: "
        "239.0.0.2:1000 from 2 subscribers on |\n",
        "| Door 0x0001 | machine: Ecu |\n", " to 10 ms; TTL 99 s |\n",
        "| Ecu | 10.0.0.1 | 224.0.0.1 | 30490 |\n"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(WriteSheet, TellsWhichBytesTrestleCannotDo) {
  Model model;
  model.services.push_back({.name = "Door"});
  std::vector<Event>& events = model.services[0].events;
  events.push_back({.name = "sum", .payload = {.crc_bytes = 4}});
  events.push_back({.name = "other", .e2e = {.profile = "9"}});
  events.push_back({.name = "unset", .e2e = {.profile = "5", .numbers = {{"data_id", 1}}}});
  events.push_back({.name = "of_calls", .e2e = {.profile = "4m", .numbers = {{"data_id", 1}}}});
  events.push_back({.name = "good", .e2e = {.profile = "4", .numbers = {{"data_id", 1}}}});
  const Written written = write_sheet(model);
  const std::string& text = written.files[0].text;
  EXPECT_THAT(text, HasSubstr("| ? | 4 | (CRC) | CRC | no source says where it is"));
  const auto paragraph = [&](const std::string& profile) {
    const std::size_t at = text.find("E2E profile " + profile + ";");
    return at == std::string::npos ? text : text.substr(at, text.find('\n', at) - at);
  };
  constexpr const char* cannot = "; its header is in front of the payload. Trestle cannot do it: ";
  EXPECT_THAT(paragraph("9"), HasSubstr(cannot));
  EXPECT_THAT(paragraph("5"), HasSubstr(std::string{cannot} + "e2e: 'data_bits' is missing"));
  EXPECT_THAT(paragraph("4m"), HasSubstr(cannot));
  EXPECT_EQ(paragraph("4"), "E2E profile 4; its header is in front of the payload.");
}

TEST(WriteSheet, TellsWhichInstancesAreProtectedOtherwise) {
  Model model;
  model.services.push_back({.name = "Door"});
  Event event{.name = "moved",
              .e2e = {.profile = "4", .numbers = {{"data_id", 1}, {"max_delta_counter", 1}}}};
  for (const std::uint16_t id : {std::uint16_t{2}, std::uint16_t{3}, std::uint16_t{4}, std::uint16_t{5}}) {
    event.e2e.set(someip::InstanceId{id},
                  {.profile = "4", .numbers = {{"data_id", id}, {"max_delta_counter", 1}}});
  }
  event.e2e.set(someip::InstanceId{3}, {.profile = "7", .numbers = {{"data_id", 1}}});
  event.e2e.set(someip::InstanceId{4}, {});
  model.services[0].events = {event};
  EXPECT_THAT(
      write_sheet(model).files[0].text,
      HasSubstr(
          "E2E profile 4; its header is in front of the payload. Instances differ: in instance 0x0002 "
          "data_id 0x0002; in instance 0x0003 profile 7; in instance 0x0004 none, and others in 1 more.\n"));
}

TEST(WriteSheet, HasErrorsOfMethodsAndUnitsOfTypes) {
  Model model;
  const TypeIndex speed = model.add({.kind = Kind::primitive, .name = "Speed", .notes = {.unit = "km/h"}});
  const TypeIndex speeds = model.add({.kind = Kind::array, .element = {.type = speed}});
  model.add({.kind = Kind::structure,
             .name = "Wheels",
             .members = {{.name = "fastest", .type = speed}, {.name = "all", .type = speeds}}});
  const TypeIndex error =
      model.add({.kind = Kind::enumeration,
                 .enumerators = {{.name = "OK", .value = 0},
                                 {.name = "JAMMED", .value = 5, .notes = {.description = "Stuck"}}}});
  model.services.push_back(
      {.name = "Door",
       .methods = {{.name = "open",
                    .request = {.values = {{.name = "speed", .type = speed}}},
                    .error = error,
                    .application_errors = {"/Errors/Door/Locked", "/Errors/Door/Hot"}}}});
  const std::string text = write_sheet(model).files[0].text;
  for (const char* part : {"| value | unit | meaning |\n| --- | --- | --- |\n| speed | km/h |  |\n",
                           "| fastest | Speed | km/h |  |\n| all | Speed[] | km/h |  |\n",
                           "\n| error of uint8 | value | meaning |\n| --- | --- | --- |\n| OK | 0 |  |\n"
                           "| JAMMED | 5 | Stuck |\n",
                           "\nErrors of the application: /Errors/Door/Locked, /Errors/Door/Hot\n"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(WriteSheet, MarksIdsThatNobodyGave) {
  EXPECT_THAT(written_sheet().files[0].text, Not(HasSubstr("chosen")));
  Model model;
  model.services.push_back(
      {.name = "Door",
       .id = someip::ServiceId{0x4abc},
       .events = {{.name = "moved",
                   .id = someip::MethodId{0x8001},
                   .eventgroups = {someip::EventgroupId{1}}}},
       .methods = {{.name = "open", .id = someip::MethodId{1}}, {.name = "shut", .id = someip::MethodId{2}}},
       .fields = {{.name = "level",
                   .getter = someip::MethodId{3},
                   .notifier = someip::MethodId{0x8002},
                   .has_setter = false}},
       .eventgroups = {{.name = "all", .id = someip::EventgroupId{1}, .id_is_chosen = true}},
       .id_is_chosen = true,
       .chosen_ids = {someip::MethodId{1}, someip::MethodId{0x8001}, someip::MethodId{3}}});
  model.instances.push_back({.service = "Door", .id = someip::InstanceId{1}, .id_is_chosen = true});
  const Written written = write_sheet(model);
  for (const char* part :
       {"| Door | 0x4abc chosen | 1.0 |", "\nchosen: Trestle chose this id, because no description gives it.",
        "\n## Door (0x4abc chosen, version 1.0)\n", "|  | 0x0001 chosen | provided |",
        "| all | 0x0001 chosen | moved |", "\n### Method open (0x0001 chosen)\n",
        "\n### Method shut (0x0002)\n", "\n### Event moved (0x8001 chosen)\n",
        "\n### Field level (getter 0x0003 chosen, notifier 0x8002)\n"}) {
    EXPECT_THAT(written.files[0].text, HasSubstr(part));
  }
}

TEST(WriteSheet, WritesOneHtmlFileThatNeedsNothingElse) {
  const std::string text = written_sheet().files[1].text;
  EXPECT_THAT(text, HasSubstr("<h3>Method open (0x0001)</h3>\n<p>Opens &amp; closes</p>"));
  EXPECT_THAT(text, HasSubstr("<td>a|b &lt;x&gt;</td>"));
  EXPECT_THAT(text, Not(HasSubstr("http")));
  EXPECT_THAT(text, Not(HasSubstr("<script")));
}

}  // namespace
}  // namespace trestle::describe
