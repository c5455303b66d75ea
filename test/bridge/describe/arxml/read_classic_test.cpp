#include <gmock/gmock.h>

#include <chrono>
#include <random>

#include "test/bridge/describe/arxml/arxml_text.hpp"

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

// --- Classic ----------------------------------------------------------------------------------------------

/// An old system description: bundles, routing groups, eventgroup id with the subscriber.
std::string classic() {
  return arxml(
      std::string{base_types} +
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Speed</SHORT-NAME><CATEGORY>VALUE</CATEGORY>" +
      props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>") +
      "</IMPLEMENTATION-DATA-TYPE><SENDER-RECEIVER-INTERFACE><SHORT-NAME>If</SHORT-NAME><DATA-ELEMENTS>" +
      event("speed", "/P/Speed") +
      "</DATA-ELEMENTS></SENDER-RECEIVER-INTERFACE><CLIENT-SERVER-INTERFACE><SHORT-NAME>Cs</"
      "SHORT-NAME><OPERATIONS>"
      "<CLIENT-SERVER-OPERATION><SHORT-NAME>reset</"
      "SHORT-NAME><ARGUMENTS><ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>to"
      "</SHORT-NAME><TYPE-TREF "
      "DEST=\"X\">/P/Speed</TYPE-TREF><DIRECTION>IN</DIRECTION></ARGUMENT-DATA-PROTOTYPE>"
      "<ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>was</SHORT-NAME><TYPE-TREF DEST=\"X\">/P/Speed</TYPE-TREF>"
      "<DIRECTION>OUT</DIRECTION></ARGUMENT-DATA-PROTOTYPE></ARGUMENTS></CLIENT-SERVER-OPERATION></"
      "OPERATIONS>"
      "</CLIENT-SERVER-INTERFACE><SYSTEM-SIGNAL><SHORT-NAME>S1</SHORT-NAME></SYSTEM-SIGNAL>"
      "<SYSTEM-SIGNAL><SHORT-NAME>S2</SHORT-NAME></SYSTEM-SIGNAL><SYSTEM-SIGNAL><SHORT-NAME>S3</SHORT-NAME>"
      "</SYSTEM-SIGNAL><SYSTEM><SHORT-NAME>Sys</SHORT-NAME><MAPPINGS><SYSTEM-MAPPING><SHORT-NAME>M</"
      "SHORT-NAME>"
      "<DATA-MAPPINGS><SENDER-RECEIVER-TO-SIGNAL-MAPPING><DATA-ELEMENT-IREF><TARGET-DATA-PROTOTYPE-REF "
      "DEST=\"X\">"
      "/P/If/speed</TARGET-DATA-PROTOTYPE-REF></DATA-ELEMENT-IREF><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1"
      "</SYSTEM-SIGNAL-REF></SENDER-RECEIVER-TO-SIGNAL-MAPPING><CLIENT-SERVER-TO-SIGNAL-MAPPING>"
      "<CALL-SIGNAL-REF DEST=\"X\">/P/S2</CALL-SIGNAL-REF><CLIENT-SERVER-OPERATION-IREF>"
      "<TARGET-OPERATION-REF DEST=\"X\">/P/Cs/reset</TARGET-OPERATION-REF></CLIENT-SERVER-OPERATION-IREF>"
      "<RETURN-SIGNAL-REF "
      "DEST=\"X\">/P/S3</RETURN-SIGNAL-REF></CLIENT-SERVER-TO-SIGNAL-MAPPING></DATA-MAPPINGS>"
      "</SYSTEM-MAPPING></MAPPINGS></SYSTEM>"
      "<I-SIGNAL><SHORT-NAME>I1</SHORT-NAME><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1</SYSTEM-SIGNAL-REF>"
      "<TRANSFORMATION-I-SIGNAL-PROPSS><SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS>"
      "<SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-VARIANTS><SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL>"
      "<TRANSFORMER-REF DEST=\"X\">/P/T/X</TRANSFORMER-REF><INTERFACE-VERSION>2</INTERFACE-VERSION>"
      "<MESSAGE-TYPE>NOTIFICATION</MESSAGE-TYPE></SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL>"
      "</SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-VARIANTS></SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS>"
      "</TRANSFORMATION-I-SIGNAL-PROPSS></I-SIGNAL>"
      "<I-SIGNAL><SHORT-NAME>I2</SHORT-NAME><SYSTEM-SIGNAL-REF "
      "DEST=\"X\">/P/S2</SYSTEM-SIGNAL-REF></I-SIGNAL>"
      "<I-SIGNAL><SHORT-NAME>I3</SHORT-NAME><SYSTEM-SIGNAL-REF "
      "DEST=\"X\">/P/S3</SYSTEM-SIGNAL-REF></I-SIGNAL>"
      "<DATA-TRANSFORMATION-SET><SHORT-NAME>T</"
      "SHORT-NAME><TRANSFORMATION-TECHNOLOGYS><TRANSFORMATION-TECHNOLOGY>"
      "<SHORT-NAME>X</"
      "SHORT-NAME><TRANSFORMATION-DESCRIPTIONS><SOMEIP-TRANSFORMATION-DESCRIPTION><ALIGNMENT>32"
      "</ALIGNMENT><BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</BYTE-ORDER></SOMEIP-TRANSFORMATION-DESCRIPTION>"
      "</TRANSFORMATION-DESCRIPTIONS></TRANSFORMATION-TECHNOLOGY></TRANSFORMATION-TECHNOLOGYS>"
      "</DATA-TRANSFORMATION-SET>" +
      [] {
        std::string pdus;
        for (const char digit : {'1', '2', '3'}) {
          pdus += std::string{"<I-SIGNAL-I-PDU><SHORT-NAME>D"} + digit +
                  "</SHORT-NAME><LENGTH>2</"
                  "LENGTH><I-SIGNAL-TO-PDU-MAPPINGS><I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>m"
                  "</SHORT-NAME><I-SIGNAL-REF DEST=\"X\">/P/I" +
                  digit +
                  "</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING></I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>";
        }
        return pdus;
      }() +
      "<GENERAL-PURPOSE-I-PDU><SHORT-NAME>Seg</SHORT-NAME><LENGTH>1404</LENGTH></GENERAL-PURPOSE-I-PDU>"
      "<SOMEIP-TP-CONFIG><SHORT-NAME>Tp</SHORT-NAME><TP-CHANNELS><SOMEIP-TP-CHANNEL><SHORT-NAME>C</"
      "SHORT-NAME>"
      "<SEPARATION-TIME>0.001</SEPARATION-TIME></SOMEIP-TP-CHANNEL></TP-CHANNELS><TP-CONNECTIONS>"
      "<SOMEIP-TP-CONNECTION><TP-CHANNEL-REF DEST=\"X\">/P/Tp/C</TP-CHANNEL-REF><TP-SDU-REF DEST=\"X\">/P/D1"
      "</TP-SDU-REF><TRANSPORT-PDU-REF "
      "DEST=\"X\">/P/Seg</TRANSPORT-PDU-REF></SOMEIP-TP-CONNECTION></TP-CONNECTIONS>"
      "</SOMEIP-TP-CONFIG><SO-AD-ROUTING-GROUP><SHORT-NAME>R</SHORT-NAME></SO-AD-ROUTING-GROUP>"
      "<ETHERNET-CLUSTER><SHORT-NAME>Net</"
      "SHORT-NAME><ETHERNET-CLUSTER-VARIANTS><ETHERNET-CLUSTER-CONDITIONAL>"
      "<PHYSICAL-CHANNELS><ETHERNET-PHYSICAL-CHANNEL><SHORT-NAME>Ch</SHORT-NAME><PDU-TRIGGERINGS>"
      "<PDU-TRIGGERING><SHORT-NAME>T1</SHORT-NAME><I-PDU-REF DEST=\"X\">/P/Seg</I-PDU-REF></PDU-TRIGGERING>"
      "<PDU-TRIGGERING><SHORT-NAME>T2</SHORT-NAME><I-PDU-REF DEST=\"X\">/P/D2</I-PDU-REF></PDU-TRIGGERING>"
      "<PDU-TRIGGERING><SHORT-NAME>T3</SHORT-NAME><I-PDU-REF DEST=\"X\">/P/D3</I-PDU-REF></PDU-TRIGGERING>"
      "</PDU-TRIGGERINGS><SO-AD-CONFIG><CONNECTION-BUNDLES><SOCKET-CONNECTION-BUNDLE><SHORT-NAME>B</"
      "SHORT-NAME>"
      "<BUNDLED-CONNECTIONS><SOCKET-CONNECTION><PDUS><SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>0x12340001"
      "</HEADER-ID><PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T1</PDU-TRIGGERING-REF><ROUTING-GROUP-REFS>"
      "<ROUTING-GROUP-REF DEST=\"X\">/P/R</ROUTING-GROUP-REF></ROUTING-GROUP-REFS>"
      "</SOCKET-CONNECTION-IPDU-IDENTIFIER><SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>305397762</"
      "HEADER-ID>"
      "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T2</PDU-TRIGGERING-REF></SOCKET-CONNECTION-IPDU-IDENTIFIER>"
      "<SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>305397762</HEADER-ID>"
      "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T3</PDU-TRIGGERING-REF></SOCKET-CONNECTION-IPDU-IDENTIFIER>"
      "</PDUS></SOCKET-CONNECTION></BUNDLED-CONNECTIONS></SOCKET-CONNECTION-BUNDLE></CONNECTION-BUNDLES>"
      "<SOCKET-ADDRESSS><SOCKET-ADDRESS><SHORT-NAME>A</SHORT-NAME><APPLICATION-ENDPOINT><SHORT-NAME>E</"
      "SHORT-NAME>"
      "<PROVIDED-SERVICE-INSTANCES><PROVIDED-SERVICE-INSTANCE><SHORT-NAME>Nav</SHORT-NAME><EVENT-HANDLERS>"
      "<EVENT-HANDLER><SHORT-NAME>G</SHORT-NAME><CONSUMED-EVENT-GROUP-REFS><CONSUMED-EVENT-GROUP-REF "
      "DEST=\"X\">"
      "/P/Net/Ch/A/E/C/g</CONSUMED-EVENT-GROUP-REF></CONSUMED-EVENT-GROUP-REFS><ROUTING-GROUP-REFS>"
      "<ROUTING-GROUP-REF "
      "DEST=\"X\">/P/R</ROUTING-GROUP-REF></ROUTING-GROUP-REFS></EVENT-HANDLER></EVENT-HANDLERS>"
      "<INSTANCE-IDENTIFIER>1</INSTANCE-IDENTIFIER><SERVICE-IDENTIFIER>4660</SERVICE-IDENTIFIER>"
      "</PROVIDED-SERVICE-INSTANCE></PROVIDED-SERVICE-INSTANCES><CONSUMED-SERVICE-INSTANCES>"
      "<CONSUMED-SERVICE-INSTANCE><SHORT-NAME>C</SHORT-NAME><CONSUMED-EVENT-GROUPS><CONSUMED-EVENT-GROUP>"
      "<SHORT-NAME>g</SHORT-NAME><EVENT-GROUP-IDENTIFIER>6</EVENT-GROUP-IDENTIFIER></CONSUMED-EVENT-GROUP>"
      "</CONSUMED-EVENT-GROUPS><PROVIDED-SERVICE-INSTANCE-REF DEST=\"X\">/P/Net/Ch/A/E/Nav"
      "</PROVIDED-SERVICE-INSTANCE-REF></CONSUMED-SERVICE-INSTANCE></CONSUMED-SERVICE-INSTANCES>"
      "<TP-CONFIGURATION><UDP-TP><UDP-TP-PORT><PORT-NUMBER>30501</PORT-NUMBER></UDP-TP-PORT></UDP-TP>"
      "</TP-CONFIGURATION></APPLICATION-ENDPOINT></SOCKET-ADDRESS></SOCKET-ADDRESSS></SO-AD-CONFIG>"
      "</ETHERNET-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></ETHERNET-CLUSTER-CONDITIONAL></"
      "ETHERNET-CLUSTER-VARIANTS>"
      "</ETHERNET-CLUSTER>");
}

TEST(ReadArxml, ReadsAClassicSystemDescription) {
  const Reading reading = read_texts({classic()});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  const Service& nav = reading.model.services[0];
  EXPECT_EQ(nav.name, "Nav");
  EXPECT_EQ(nav.id, someip::ServiceId{0x1234});
  EXPECT_EQ(nav.major, 2);
  ASSERT_EQ(nav.events.size(), 1U);
  const Event& speed = nav.events[0];
  EXPECT_EQ(speed.name, "speed");
  EXPECT_EQ(speed.id, someip::MethodId{1}) << "a HEADER-ID is a whole message id: no bit 15 is set";
  EXPECT_THAT(speed.eventgroups, ElementsAre(someip::EventgroupId{6}));
  EXPECT_EQ(speed.payload.byte_order, std::endian::little);
  EXPECT_EQ(speed.payload.alignment, 4);
  EXPECT_EQ(speed.transfer.segment_bytes, 1392U);
  EXPECT_EQ(speed.transfer.separation, 1ms);
  EXPECT_EQ(resolved(reading.model, speed.payload.values.at(0).type).primitive, messages::Primitive::uint16);
  ASSERT_EQ(nav.methods.size(), 1U);
  EXPECT_EQ(nav.methods[0].name, "reset");
  EXPECT_EQ(nav.methods[0].id, someip::MethodId{2});
  EXPECT_EQ(nav.methods[0].request.values.at(0).name, "to");
  EXPECT_EQ(nav.methods[0].response.values.at(0).name, "was");
  ASSERT_EQ(reading.model.instances.size(), 2U);
  EXPECT_THAT(reading.model.instances[1].eventgroups, ElementsAre(someip::EventgroupId{6}));
  EXPECT_EQ(reading.model.instances[1].service_id, someip::ServiceId{0x1234});
}

/// `text` with the only `old` in it replaced.
std::string replaced(std::string text, std::string_view old, std::string_view by) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), by);
}

/// classic(), where nothing but the routing group tells that the message is an event; it stands at `holder`.
std::string with_routing_group_at(std::string_view holder) {
  const std::string_view group =
      "<ROUTING-GROUP-REFS><ROUTING-GROUP-REF DEST=\"X\">/P/R</ROUTING-GROUP-REF></ROUTING-GROUP-REFS>";
  std::string text = replaced(classic(), "<MESSAGE-TYPE>NOTIFICATION</MESSAGE-TYPE>", "");
  text = replaced(std::move(text),
                  "<SENDER-RECEIVER-TO-SIGNAL-MAPPING><DATA-ELEMENT-IREF><TARGET-DATA-PROTOTYPE-REF "
                  "DEST=\"X\">/P/If/speed</TARGET-DATA-PROTOTYPE-REF></DATA-ELEMENT-IREF>"
                  "<SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1</SYSTEM-SIGNAL-REF>"
                  "</SENDER-RECEIVER-TO-SIGNAL-MAPPING>",
                  "");
  text = replaced(std::move(text), std::string{group} + "</EVENT-HANDLER>", "</EVENT-HANDLER>");
  const std::string end = "</" + std::string{holder} + ">";
  return replaced(std::move(text), end, std::string{group} + end);
}

TEST(ReadArxml, TakesTheRoutingGroupsOfAnEventgroupFromItsSubscribers) {
  for (const char* const holder : {"EVENT-HANDLER", "CONSUMED-EVENT-GROUP"}) {
    const Reading reading = read_texts({with_routing_group_at(holder)});
    EXPECT_THAT(problems_of(reading), HasSubstr("no mapping tells the data type"));
    const Service& nav = reading.model.services.at(0);
    ASSERT_EQ(nav.events.size(), 1U) << holder;
    EXPECT_EQ(nav.events[0].id, someip::MethodId{1});
    EXPECT_THAT(nav.events[0].eventgroups, ElementsAre(someip::EventgroupId{6}));
    ASSERT_EQ(nav.methods.size(), 1U);
    EXPECT_EQ(nav.methods[0].name, "reset");
  }
}

TEST(ReadArxml, KnowsAnEventgroupThatNobodyInTheFileOffers) {
  std::string text = with_routing_group_at("CONSUMED-EVENT-GROUP");
  const std::size_t from = text.find("<PROVIDED-SERVICE-INSTANCES>");
  const std::string_view end = "</PROVIDED-SERVICE-INSTANCES>";
  text.erase(from, text.find(end) + end.size() - from);
  text = replaced(std::move(text),
                  "<PROVIDED-SERVICE-INSTANCE-REF DEST=\"X\">/P/Net/Ch/A/E/Nav"
                  "</PROVIDED-SERVICE-INSTANCE-REF>",
                  "<SERVICE-IDENTIFIER>4660</SERVICE-IDENTIFIER>");
  const Reading reading = read_texts({text});
  const Service& service = reading.model.services.at(0);
  ASSERT_EQ(service.eventgroups.size(), 1U);
  EXPECT_EQ(service.eventgroups[0].name, "g");
  EXPECT_EQ(service.eventgroups[0].id, someip::EventgroupId{6});
  ASSERT_EQ(service.events.size(), 1U);
  EXPECT_THAT(service.events[0].eventgroups, ElementsAre(someip::EventgroupId{6}));
}

TEST(ReadArxml, ReadsSocketConnectionsWithoutABundle) {
  std::string text = classic();
  text = replaced(std::move(text),
                  "<CONNECTION-BUNDLES><SOCKET-CONNECTION-BUNDLE><SHORT-NAME>B</SHORT-NAME>"
                  "<BUNDLED-CONNECTIONS><SOCKET-CONNECTION>",
                  "<CONNECTIONS><SOCKET-CONNECTION><LOCAL-PORT-REF DEST=\"X\">/P/Net/Ch/A</LOCAL-PORT-REF>");
  text = replaced(std::move(text), "</BUNDLED-CONNECTIONS></SOCKET-CONNECTION-BUNDLE></CONNECTION-BUNDLES>",
                  "</CONNECTIONS>");
  text = replaced(std::move(text), "<UDP-TP><UDP-TP-PORT>", "<TCP-TP><TCP-TP-PORT>");
  text = replaced(std::move(text), "</UDP-TP-PORT></UDP-TP>", "</TCP-TP-PORT></TCP-TP>");
  const Reading reading = read_texts({text});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  const Service& nav = reading.model.services[0];
  ASSERT_EQ(nav.events.size(), 1U);
  EXPECT_EQ(nav.events[0].name, "speed");
  EXPECT_EQ(nav.events[0].transfer.transport, Transport::tcp);
  EXPECT_THAT(nav.events[0].eventgroups, ElementsAre(someip::EventgroupId{6}));
  ASSERT_EQ(nav.methods.size(), 1U);
  EXPECT_EQ(nav.methods[0].request_transfer.transport, Transport::tcp);
}

/// classic(), with a trigger in place of the data element.
std::string with_trigger() {
  return replaced(
      replaced(
          classic(),
          "<SENDER-RECEIVER-TO-SIGNAL-MAPPING><DATA-ELEMENT-IREF><TARGET-DATA-PROTOTYPE-REF DEST=\"X\">"
          "/P/If/speed</TARGET-DATA-PROTOTYPE-REF></DATA-ELEMENT-IREF><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1"
          "</SYSTEM-SIGNAL-REF></SENDER-RECEIVER-TO-SIGNAL-MAPPING>",
          "<TRIGGER-TO-SIGNAL-MAPPING><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1</SYSTEM-SIGNAL-REF>"
          "<TRIGGER-IREF><TARGET-TRIGGER-REF DEST=\"X\">/P/Ti/Fire</TARGET-TRIGGER-REF></TRIGGER-IREF>"
          "</TRIGGER-TO-SIGNAL-MAPPING>"),
      "<CLIENT-SERVER-INTERFACE>",
      "<TRIGGER-INTERFACE><SHORT-NAME>Ti</SHORT-NAME><TRIGGERS><TRIGGER><SHORT-NAME>Fire</SHORT-NAME>"
      "</TRIGGER></TRIGGERS></TRIGGER-INTERFACE><CLIENT-SERVER-INTERFACE>");
}

TEST(ReadArxml, ReadsTriggersOfClassicAsEventsWithoutData) {
  const Reading reading = read_texts({with_trigger()});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  ASSERT_EQ(reading.model.services[0].events.size(), 1U);
  const Event& fire = reading.model.services[0].events[0];
  EXPECT_EQ(fire.name, "Fire");
  EXPECT_TRUE(fire.payload.known);
  EXPECT_THAT(fire.payload.values, IsEmpty());
}

TEST(ReadArxml, ReadsTriggersThatAreSentAsRequestsAsMethods) {
  const Reading reading = read_texts({replaced(with_trigger(), "<MESSAGE-TYPE>NOTIFICATION</MESSAGE-TYPE>",
                                               "<MESSAGE-TYPE>REQUEST_NO_RETURN</MESSAGE-TYPE>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  EXPECT_THAT(reading.model.services[0].events, IsEmpty());
  ASSERT_EQ(reading.model.services[0].methods.size(), 2U);
  const Method& fire = reading.model.services[0].methods[0];
  EXPECT_EQ(fire.name, "Fire");
  EXPECT_TRUE(fire.fire_and_forget);
  EXPECT_TRUE(fire.request.known);
  EXPECT_THAT(fire.request.values, IsEmpty());
}

TEST(ReadArxml, TakesTheTransportFromWhoActivatesAPdu) {
  // R20 and newer: the connections of clients are made when they subscribe, and stand nowhere.
  std::string text = classic();
  const std::size_t from = text.find("<CONNECTION-BUNDLES>");
  const std::string_view end = "</CONNECTION-BUNDLES>";
  ASSERT_NE(from, std::string::npos);
  text.replace(from, text.find(end) + end.size() - from, "");
  text = replaced(std::move(text), "<SO-AD-ROUTING-GROUP>",
                  "<SOCKET-CONNECTION-IPDU-IDENTIFIER-SET><SHORT-NAME>Ids</SHORT-NAME><I-PDU-IDENTIFIERS>"
                  "<SO-CON-I-PDU-IDENTIFIER><SHORT-NAME>E</SHORT-NAME><HEADER-ID>0x12340001</HEADER-ID>"
                  "<PDU-COLLECTION-PDU-TIMEOUT>0.005</PDU-COLLECTION-PDU-TIMEOUT>"
                  "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T1</PDU-TRIGGERING-REF></SO-CON-I-PDU-IDENTIFIER>"
                  "<SO-CON-I-PDU-IDENTIFIER><SHORT-NAME>M</SHORT-NAME><HEADER-ID>0x12340002</HEADER-ID>"
                  "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T2</PDU-TRIGGERING-REF></SO-CON-I-PDU-IDENTIFIER>"
                  "</I-PDU-IDENTIFIERS></SOCKET-CONNECTION-IPDU-IDENTIFIER-SET><SO-AD-ROUTING-GROUP>");
  text = replaced(std::move(text),
                  "</CONSUMED-EVENT-GROUP-REFS><ROUTING-GROUP-REFS><ROUTING-GROUP-REF DEST=\"X\">/P/R"
                  "</ROUTING-GROUP-REF></ROUTING-GROUP-REFS>",
                  "</CONSUMED-EVENT-GROUP-REFS><PDU-ACTIVATION-ROUTING-GROUPS><PDU-ACTIVATION-ROUTING-GROUP>"
                  "<SHORT-NAME>a</SHORT-NAME><I-PDU-IDENTIFIER-TCP-REFS><I-PDU-IDENTIFIER-TCP-REF DEST=\"X\">"
                  "/P/Ids/E</I-PDU-IDENTIFIER-TCP-REF></I-PDU-IDENTIFIER-TCP-REFS>"
                  "</PDU-ACTIVATION-ROUTING-GROUP></PDU-ACTIVATION-ROUTING-GROUPS>");
  text = replaced(std::move(text), "<SHORT-NAME>Nav</SHORT-NAME>",
                  "<SHORT-NAME>Nav</SHORT-NAME><METHOD-ACTIVATION-ROUTING-GROUPS>"
                  "<PDU-ACTIVATION-ROUTING-GROUP><SHORT-NAME>m</SHORT-NAME><I-PDU-IDENTIFIER-TCP-REFS>"
                  "<I-PDU-IDENTIFIER-TCP-REF DEST=\"X\">/P/Ids/M</I-PDU-IDENTIFIER-TCP-REF>"
                  "</I-PDU-IDENTIFIER-TCP-REFS></PDU-ACTIVATION-ROUTING-GROUP>"
                  "</METHOD-ACTIVATION-ROUTING-GROUPS>");
  const Reading reading = read_texts({text});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Service& nav = reading.model.services.at(0);
  EXPECT_EQ(nav.events.at(0).transfer.transport, Transport::tcp);
  EXPECT_EQ(nav.events.at(0).transfer.retention, 5ms);
  EXPECT_THAT(nav.events.at(0).eventgroups, ElementsAre(someip::EventgroupId{6}));
  EXPECT_EQ(nav.methods.at(0).request_transfer.transport, Transport::tcp);
}

/// E2E protection of an I-SIGNAL.
std::string protected_by(std::string_view data_id) {
  const std::string tag = "END-TO-END-TRANSFORMATION-I-SIGNAL-PROPS";
  return "<" + tag + "><" + tag + "-VARIANTS><" + tag +
         "-CONDITIONAL><TRANSFORMER-REF DEST=\"X\">/P/T/E2e"
         "</TRANSFORMER-REF><DATA-IDS><DATA-ID>" +
         std::string{data_id} + "</DATA-ID></DATA-IDS></" + tag + "-CONDITIONAL></" + tag + "-VARIANTS></" +
         tag + ">";
}

/// classic() with a second instance, which sends the event with another data id from a socket of its own.
std::string with_two_instances(std::string_view instance) {
  std::string text = replaced(classic(), "</TRANSFORMATION-I-SIGNAL-PROPSS>",
                              protected_by("0x11") + "</TRANSFORMATION-I-SIGNAL-PROPSS>");
  const auto add = [&](std::string_view before, const std::string& more) {
    text = replaced(std::move(text), before, more + std::string{before});
  };
  add("</TRANSFORMATION-TECHNOLOGYS>",
      "<TRANSFORMATION-TECHNOLOGY><SHORT-NAME>E2e</SHORT-NAME><TRANSFORMATION-DESCRIPTIONS>"
      "<END-TO-END-TRANSFORMATION-DESCRIPTION><PROFILE-NAME>PROFILE_04</PROFILE-NAME>"
      "</END-TO-END-TRANSFORMATION-DESCRIPTION></TRANSFORMATION-DESCRIPTIONS></TRANSFORMATION-TECHNOLOGY>");
  add("<GENERAL-PURPOSE-I-PDU>",
      "<I-SIGNAL><SHORT-NAME>I4</SHORT-NAME><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1</SYSTEM-SIGNAL-REF>"
      "<TRANSFORMATION-I-SIGNAL-PROPSS>" +
          protected_by("0x12") +
          "</TRANSFORMATION-I-SIGNAL-PROPSS></I-SIGNAL><I-SIGNAL-I-PDU><SHORT-NAME>D4</SHORT-NAME>"
          "<LENGTH>2</LENGTH><I-SIGNAL-TO-PDU-MAPPINGS><I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>m</SHORT-NAME>"
          "<I-SIGNAL-REF DEST=\"X\">/P/I4</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING>"
          "</I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>");
  add("</PDU-TRIGGERINGS>",
      "<PDU-TRIGGERING><SHORT-NAME>T4</SHORT-NAME><I-PDU-REF DEST=\"X\">/P/D4</I-PDU-REF></PDU-TRIGGERING>");
  add("</CONNECTION-BUNDLES>",
      "<SOCKET-CONNECTION-BUNDLE><SHORT-NAME>B2</SHORT-NAME><BUNDLED-CONNECTIONS><SOCKET-CONNECTION><PDUS>"
      "<SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>0x12340001</HEADER-ID><PDU-TRIGGERING-REF DEST=\"X\">"
      "/P/Net/Ch/T4</PDU-TRIGGERING-REF></SOCKET-CONNECTION-IPDU-IDENTIFIER></PDUS></SOCKET-CONNECTION>"
      "</BUNDLED-CONNECTIONS><SERVER-PORT-REF DEST=\"X\">/P/Net/Ch/A2</SERVER-PORT-REF>"
      "</SOCKET-CONNECTION-BUNDLE>");
  add("</SOCKET-ADDRESSS>",
      "<SOCKET-ADDRESS><SHORT-NAME>A2</SHORT-NAME><APPLICATION-ENDPOINT><SHORT-NAME>E</SHORT-NAME>"
      "<PROVIDED-SERVICE-INSTANCES><PROVIDED-SERVICE-INSTANCE><SHORT-NAME>Nav2</SHORT-NAME>" +
          std::string{instance} +
          "<SERVICE-IDENTIFIER>4660</SERVICE-IDENTIFIER></PROVIDED-SERVICE-INSTANCE>"
          "</PROVIDED-SERVICE-INSTANCES></APPLICATION-ENDPOINT></SOCKET-ADDRESS>");
  return text;
}

TEST(ReadArxml, ReadsTheProtectionOfEachInstanceOfClassic) {
  const Reading reading = read_texts({with_two_instances("<INSTANCE-IDENTIFIER>2</INSTANCE-IDENTIFIER>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.at(0).events.size(), 1U);
  const Protection& e2e = reading.model.services[0].events[0].e2e;
  EXPECT_EQ(e2e.profile, "4");
  EXPECT_EQ(e2e.of(someip::InstanceId{1}).numbers.at("data_id"), 0x11U);
  EXPECT_EQ(e2e.of(someip::InstanceId{2}).numbers.at("data_id"), 0x12U);
  // Of which instance it is must be known.
  EXPECT_THAT(problems_of(read_texts({with_two_instances("")})),
              HasSubstr("warning: /P/I4 has another data_id than another instance of the service: what was "
                        "read first is taken, as its instance has no id"));
}

TEST(ReadArxml, ReadsHowOftenAPduIsSent) {
  const Reading reading = read_texts(
      {replaced(classic(), "<SHORT-NAME>D1</SHORT-NAME><LENGTH>2</LENGTH>",
                "<SHORT-NAME>D1</SHORT-NAME><LENGTH>2</LENGTH><I-PDU-TIMING-SPECIFICATIONS><I-PDU-TIMING>"
                "<TRANSMISSION-MODE-DECLARATION><TRANSMISSION-MODE-TRUE-TIMING><CYCLIC-TIMING><TIME-PERIOD>"
                "<VALUE>0.02</VALUE></TIME-PERIOD></CYCLIC-TIMING></TRANSMISSION-MODE-TRUE-TIMING>"
                "</TRANSMISSION-MODE-DECLARATION></I-PDU-TIMING></I-PDU-TIMING-SPECIFICATIONS>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  EXPECT_EQ(reading.model.services.at(0).events.at(0).cycle, 20ms);
}

TEST(ReadArxml, DoesNotTakeTheFirstOfSeveralSignalsForTheWholePayload) {
  const Reading reading = read_texts(
      {replaced(classic(), "<I-SIGNAL-REF DEST=\"X\">/P/I1</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING>",
                "<I-SIGNAL-REF DEST=\"X\">/P/I1</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING>"
                "<I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>n</SHORT-NAME><I-SIGNAL-REF DEST=\"X\">/P/I2"
                "</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING>")});
  EXPECT_THAT(problems_of(reading), HasSubstr("/P/D1 has several signals"));
  ASSERT_EQ(reading.problems.size(), 1U) << problems_of(reading);  // not also that no mapping tells its type
  EXPECT_GT(reading.problems[0].mark.line, 0);
  const Event& event = reading.model.services.at(0).events.at(0);
  EXPECT_FALSE(event.payload.known);
  EXPECT_THAT(event.payload.values, IsEmpty());
}

TEST(ReadArxml, SurvivesMutations) {
  const std::string whole = classic();
  std::mt19937 random{25};
  for (int round = 0; round < 300; ++round) {
    std::string text = whole;
    for (int change = 0; change < 3; ++change) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text.erase(at, random() % 200);
          break;
        case 1:
          text.insert(at, text.substr(random() % text.size(), random() % 300));
          break;
        case 2:
          text[at] = static_cast<char>(random());
          break;
        default:
          // One name for another: references and types go astray, the XML stays whole.
          for (std::size_t i = at; i + 4 < text.size(); ++i) {
            if (text.compare(i, 3, "/P/") == 0) {
              text[i + 3] = "SIDTRN"[random() % 6];
              break;
            }
          }
      }
    }
    const Reading reading = read_texts({text});
    for (const documents::Problem& problem : reading.problems) {
      EXPECT_EQ(problem.file, "0.arxml");
      EXPECT_FALSE(problem.text.empty());
    }
    EXPECT_LE(reading.problems.size(), 100U);
  }
}

}  // namespace
}  // namespace trestle::describe
