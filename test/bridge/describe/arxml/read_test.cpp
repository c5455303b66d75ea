#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>

#include "bridge/describe/join.hpp"
#include "test/bridge/describe/arxml/arxml_text.hpp"

namespace trestle::describe {
namespace {

using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

TEST(ReadArxml, ReadsAServiceWithItsDeployment) {
  const Reading reading = read_texts({arxml(
      service(
          "<DESC><L-2 L=\"DE\">Tür</L-2><L-2 L=\"EN\">A <TT>door</TT></L-2></DESC>"
          "<NAMESPACES><SYMBOL-PROPS><SHORT-NAME>a</SHORT-NAME><SYMBOL>car</SYMBOL></SYMBOL-PROPS></"
          "NAMESPACES>"
          "<MAJOR-VERSION>3</MAJOR-VERSION><MINOR-VERSION>1</MINOR-VERSION><EVENTS>" +
          event("moved", "/ara/stdtypes/uint16_t") +
          "</EVENTS><FIELDS><FIELD><SHORT-NAME>angle</SHORT-NAME><TYPE-TREF DEST=\"X\">/AUTOSAR/Types/sint8"
          "</TYPE-TREF><HAS-GETTER>true</HAS-GETTER><HAS-NOTIFIER>true</HAS-NOTIFIER><HAS-SETTER>false"
          "</HAS-SETTER></FIELD></FIELDS><METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>open</SHORT-NAME>"
          "<ARGUMENTS><ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>speed</SHORT-NAME><TYPE-TREF DEST=\"X\">"
          "/x/float</TYPE-TREF><DIRECTION>INOUT</DIRECTION></ARGUMENT-DATA-PROTOTYPE></ARGUMENTS>"
          "<POSSIBLE-AP-ERROR-REFS><POSSIBLE-AP-ERROR-REF DEST=\"X\">/E/Jammed</POSSIBLE-AP-ERROR-REF>"
          "</POSSIBLE-AP-ERROR-REFS></CLIENT-SERVER-OPERATION></METHODS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/moved</EVENT-REF>"
      "<EVENT-ID>0x8001</EVENT-ID><MAXIMUM-SEGMENT-LENGTH>1404</MAXIMUM-SEGMENT-LENGTH>"
      "<SEPARATION-TIME>0.002</SEPARATION-TIME><TRANSPORT-PROTOCOL>UDP</TRANSPORT-PROTOCOL>"
      "</SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><FIELD-DEPLOYMENTS><SOMEIP-FIELD-DEPLOYMENT>"
      "<SHORT-NAME>f</SHORT-NAME><FIELD-REF "
      "DEST=\"X\">/P/Door/angle</FIELD-REF><GET><SHORT-NAME>g</SHORT-NAME>"
      "<METHOD-ID>5</METHOD-ID><TRANSPORT-PROTOCOL>TCP</TRANSPORT-PROTOCOL></GET><NOTIFIER><SHORT-NAME>Note"
      "</SHORT-NAME><EVENT-ID>32770</EVENT-ID></NOTIFIER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS>"
      "<METHOD-DEPLOYMENTS><SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>o</SHORT-NAME><METHOD-REF "
      "DEST=\"X\">/P/Door/open"
      "</METHOD-REF><METHOD-ID>7</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP>"
      "<SHORT-NAME>All</SHORT-NAME><EVENT-GROUP-ID>9</EVENT-GROUP-ID><EVENT-REFS>"
      "<EVENT-REF DEST=\"SOMEIP-EVENT-DEPLOYMENT\">/P/Dep/m</EVENT-REF>"
      "<EVENT-REF "
      "DEST=\"SOMEIP-EVENT-DEPLOYMENT\">/P/Dep/f/Note</EVENT-REF></EVENT-REFS></SOMEIP-EVENT-GROUP>"
      "</EVENT-GROUPS><SERVICE-INTERFACE-ID>4660</SERVICE-INTERFACE-ID></"
      "SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  const Service& door = reading.model.services[0];
  EXPECT_EQ(door.scope, "/P");
  EXPECT_EQ(door.id, someip::ServiceId{0x1234});
  EXPECT_EQ(door.major, 3);
  EXPECT_EQ(door.minor, 1U);
  EXPECT_EQ(door.notes.description, "A door");
  EXPECT_THAT(door.namespaces, ElementsAre("car"));
  EXPECT_EQ(door.events[0].id, someip::MethodId{0x8001});
  EXPECT_EQ(door.events[0].transfer.segment_bytes, 1392U);
  EXPECT_EQ(door.events[0].transfer.separation, 2ms);
  EXPECT_THAT(door.events[0].eventgroups, ElementsAre(someip::EventgroupId{9}));
  EXPECT_EQ(door.fields[0].getter, someip::MethodId{5});
  EXPECT_EQ(door.fields[0].getter_transfer.transport, Transport::tcp);
  EXPECT_EQ(door.fields[0].notifier, someip::MethodId{0x8002});
  EXPECT_FALSE(door.fields[0].has_setter);
  EXPECT_THAT(door.fields[0].eventgroups, ElementsAre(someip::EventgroupId{9}));
  EXPECT_EQ(door.methods[0].id, someip::MethodId{7});
  EXPECT_EQ(door.methods[0].request.values[0].name, "speed");
  EXPECT_EQ(door.methods[0].response.values[0].name, "speed");
  EXPECT_THAT(door.methods[0].inout, ElementsAre("speed"));
  EXPECT_THAT(door.methods[0].application_errors, ElementsAre("/E/Jammed"));
}

TEST(ReadArxml, RefusesNamesThatAreNone) {
  const std::string in_two_lines = problems_of(
      read_texts({arxml("\n<SERVICE-INTERFACE><SHORT-NAME>Do\nor</SHORT-NAME></SERVICE-INTERFACE>")}));
  EXPECT_THAT(
      in_two_lines,
      HasSubstr("0.arxml:3:20: error: a line end or another control character is in this SHORT-NAME"));
  // Elements before a name that has one in it stay.
  const Reading nested = read_texts(
      {arxml("<SERVICE-INTERFACE><EVENTS>" + event("moved", "/x/uint8") +
             "</EVENTS><SHORT-NAME>Do<SHORT-NAME>x</SHORT-NAME>or</SHORT-NAME></SERVICE-INTERFACE>")});
  EXPECT_THAT(problems_of(nested), HasSubstr("error: an element stands in a SHORT-NAME"));
  ASSERT_EQ(nested.model.services.size(), 1U);
  EXPECT_EQ(nested.model.services[0].name, "Door");
  EXPECT_EQ(nested.model.services[0].events.size(), 1U);
}

std::string deployed_event(std::string_view id) {
  return arxml(
      service("<EVENTS>" + event("e", "/x/uint8") + "</EVENTS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/e</EVENT-REF>"
      "<EVENT-ID>" +
      std::string{id} +
      "</EVENT-ID></SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>");
}

TEST(ReadArxml, SetsBit15OfEventIdsAndSaysSo) {
  const Reading reading = read_texts({deployed_event("12332")});
  EXPECT_EQ(reading.model.services[0].events[0].id, someip::MethodId{0xb02c});
  EXPECT_THAT(problems_of(reading), HasSubstr("bit 15"));
  const Reading as_it_is = read_texts({deployed_event("12332")}, {.set_event_bit = false});
  EXPECT_EQ(as_it_is.model.services[0].events[0].id, someip::MethodId{0x302c});
  EXPECT_THAT(problems_of(as_it_is), IsEmpty());
  EXPECT_THAT(problems_of(read_texts({deployed_event("70000")})),
              HasSubstr("error: EVENT-ID is \"70000\", and a number from 0 to 65535 was expected"));
}

/// Not where the interface is.
TEST(ReadArxml, KnowsWhereIdsStand) {
  const std::string text = arxml(
      service(
          "<EVENTS>" + event("e", "/x/uint8") +
          "</EVENTS><FIELDS><FIELD><SHORT-NAME>f</SHORT-NAME></FIELD>"
          "</FIELDS><METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>m</SHORT-NAME></CLIENT-SERVER-OPERATION>"
          "</METHODS>") +
      "\n<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME>"
      "\n<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "\n<SERVICE-INTERFACE-ID>65535</SERVICE-INTERFACE-ID><EVENT-DEPLOYMENTS><SOMEIP-EVENT-DEPLOYMENT>"
      "<SHORT-NAME>e</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/e</EVENT-REF>"
      "\n<EVENT-ID>32769</EVENT-ID></SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><FIELD-DEPLOYMENTS>"
      "<SOMEIP-FIELD-DEPLOYMENT><SHORT-NAME>f</SHORT-NAME><FIELD-REF DEST=\"X\">/P/Door/f</FIELD-REF><GET>"
      "\n<METHOD-ID>1</METHOD-ID></GET><SET>"
      "\n<METHOD-ID>2</METHOD-ID></SET><NOTIFIER>"
      "\n<EVENT-ID>32769</EVENT-ID></NOTIFIER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS>"
      "<METHOD-DEPLOYMENTS><SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><METHOD-REF "
      "DEST=\"X\">/P/Door/m"
      "</METHOD-REF>"
      "\n<METHOD-ID>32771</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>");
  Reading reading = read_texts({text});
  ASSERT_TRUE(reading.ok()) << problems_of(reading);
  const int first = reading.model.services.at(0).id_place.mark.line;
  std::vector<std::string> told;
  for (const documents::Problem& problem : join(reading.model)) {
    told.push_back(fmt::format("{}: {}", problem.mark.line - first, problem.text));
  }
  EXPECT_THAT(told,
              ElementsAre("0: service Door has the id 0xffff, which is that of service discovery and magic "
                          "cookies: give it another one",
                          fmt::format("4: Door.f (notifier) has the id 0x8001 of Door.e, at "
                                      "0.arxml:{}:1",
                                      first + 1),
                          "5: Door.m has the id 0x8003: methods have no bit 15, from 0x0001 to 0x7ffe"));
  const Field& field = reading.model.services.at(0).fields.at(0);
  EXPECT_EQ(field.getter_place.mark.line, first + 2);
  EXPECT_EQ(field.setter_place.mark.line, first + 3);
}

TEST(ReadArxml, TakesAServiceIdOfNothingForNone) {
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>D</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><SERVICE-INTERFACE-ID>0</SERVICE-INTERFACE-ID>"
      "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: SERVICE-INTERFACE-ID 0 is reserved"));
  EXPECT_FALSE(reading.model.services.at(0).id);
}

TEST(ReadArxml, CallsASecondMemberOfOneNameAnother) {
  const std::string element =
      "<CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>x</SHORT-NAME><TYPE-REFERENCE><TYPE-REFERENCE-REF "
      "DEST=\"X\">/ara/stdtypes/uint8_t</TYPE-REFERENCE-REF></TYPE-REFERENCE></"
      "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT>";
  const Reading reading =
      read_texts({arxml(service("<EVENTS>" + event("e", "/P/Pair") + "</EVENTS>") +
                        "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Pair</SHORT-NAME><CATEGORY>STRUCTURE</"
                        "CATEGORY><SUB-ELEMENTS>" +
                        element + element + element + "</SUB-ELEMENTS></STD-CPP-IMPLEMENTATION-DATA-TYPE>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: there is a member x before: this one is called x_2"));
  const Type& type =
      resolved(reading.model, reading.model.services.at(0).events.at(0).payload.values.at(0).type);
  ASSERT_EQ(type.members.size(), 3U);
  EXPECT_EQ(type.members[1].name, "x_2");
  EXPECT_EQ(type.members[2].name, "x_3");
}

TEST(ReadArxml, LeavesOutASecondMemberOfOneName) {
  const std::string operation =
      "<CLIENT-SERVER-OPERATION><SHORT-NAME>open</SHORT-NAME></CLIENT-SERVER-OPERATION>";
  const std::string field =
      "<FIELD><SHORT-NAME>f</SHORT-NAME><TYPE-TREF DEST=\"X\">/ara/stdtypes/uint16_t</TYPE-TREF></FIELD>";
  const Reading reading = read_texts({arxml(service(
      "<EVENTS>" + event("moved", "/ara/stdtypes/uint16_t") + event("moved", "/ara/stdtypes/uint8_t") +
      "</EVENTS><FIELDS>" + field + field + "</FIELDS><METHODS>" + operation + operation + "</METHODS>"))});
  EXPECT_TRUE(reading.ok()) << problems_of(reading);
  const Service& door = reading.model.services.at(0);
  EXPECT_EQ(door.events.size(), 1U);
  EXPECT_EQ(door.methods.size(), 1U);
  EXPECT_EQ(door.fields.size(), 1U);
  for (const char* name : {"moved", "open", "f"}) {
    EXPECT_THAT(
        problems_of(reading),
        ContainsRegex("/P/Door/" + std::string{name} +
                      " is there twice: this one is left out, the one at 0.arxml:[0-9]+:[0-9]+ is taken"));
  }
}

TEST(ReadArxml, TellsWhereBothStandThatHaveOneName) {
  const Reading reading =
      read_texts({arxml(""), arxml("\n" + std::string{service("")} + "\n  " + std::string{service("")})});
  EXPECT_THAT(problems_of(reading),
              HasSubstr("1.arxml:4:3: warning: /P/Door is declared twice; references mean "
                        "the one at 1.arxml:3:1\n"));
}

TEST(ReadArxml, TellsThatAMethodIdOfZeroIsNone) {
  const Reading reading = read_texts({arxml(
      service("<METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>open</SHORT-NAME></CLIENT-SERVER-OPERATION>"
              "</METHODS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><METHOD-DEPLOYMENTS>"
      "<SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>o</SHORT-NAME><METHOD-REF DEST=\"X\">/P/Door/open</METHOD-REF>"
      "<METHOD-ID>0x0</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "<SERVICE-INTERFACE-ID>4660</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_FALSE(reading.model.services.at(0).methods.at(0).id.has_value());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: METHOD-ID 0 is reserved: it counts as not given"));
}

TEST(ReadArxml, DoesNotKnowThePayloadsOfADeploymentWithoutItsInterface) {
  const Reading reading = read_texts({arxml(
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/moved</EVENT-REF>"
      "<EVENT-ID>0x8001</EVENT-ID></SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><METHOD-DEPLOYMENTS>"
      "<SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>o</SHORT-NAME><METHOD-REF DEST=\"X\">/P/Door/open</METHOD-REF>"
      "<METHOD-ID>7</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "<SERVICE-INTERFACE-ID>4660</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_THAT(problems_of(reading), HasSubstr("its types are not known"));
  const Service& door = reading.model.services.at(0);
  EXPECT_FALSE(door.events.at(0).payload.known);
  EXPECT_FALSE(door.methods.at(0).request.known);
  EXPECT_FALSE(door.methods.at(0).response.known);
}

TEST(ReadArxml, ReadsInstancesWithTheirMachines) {
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP>"
      "<SHORT-NAME>G</SHORT-NAME><EVENT-GROUP-ID>3</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>0x20</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
      "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Left</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
      "DEST=\"X\">"
      "/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><CAPABILITY-RECORDS><TAG-WITH-OPTIONAL-VALUE><KEY>side</KEY>"
      "<VALUE>left</VALUE></TAG-WITH-OPTIONAL-VALUE></CAPABILITY-RECORDS><PROVIDED-EVENT-GROUPS>"
      "<SOMEIP-PROVIDED-EVENT-GROUP><SHORT-NAME>g</SHORT-NAME><EVENT-GROUP-REF "
      "DEST=\"X\">/P/Dep/G</EVENT-GROUP-REF>"
      "<EVENT-MULTICAST-UDP-PORT>30600</EVENT-MULTICAST-UDP-PORT><IPV-4-MULTICAST-IP-ADDRESS>239.0.0.9"
      "</IPV-4-MULTICAST-IP-ADDRESS><MULTICAST-THRESHOLD>4</MULTICAST-THRESHOLD></"
      "SOMEIP-PROVIDED-EVENT-GROUP>"
      "</PROVIDED-EVENT-GROUPS><SD-SERVER-CONFIG-REF DEST=\"X\">/P/Sd</SD-SERVER-CONFIG-REF>"
      "<SERVICE-INSTANCE-ID>7</SERVICE-INSTANCE-ID></PROVIDED-SOMEIP-SERVICE-INSTANCE>"
      "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Any</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
      "DEST=\"X\">"
      "/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><REQUIRED-MINOR-VERSION>ANY</REQUIRED-MINOR-VERSION>"
      "<REQUIRED-SERVICE-INSTANCE-ID>ALL</REQUIRED-SERVICE-INSTANCE-ID></REQUIRED-SOMEIP-SERVICE-INSTANCE>"
      "<SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG><SHORT-NAME>Sd</SHORT-NAME><INITIAL-OFFER-BEHAVIOR>"
      "<INITIAL-DELAY-MAX-VALUE>0.05</INITIAL-DELAY-MAX-VALUE><INITIAL-DELAY-MIN-VALUE>0.01"
      "</INITIAL-DELAY-MIN-VALUE><INITIAL-REPETITIONS-MAX>2</INITIAL-REPETITIONS-MAX></"
      "INITIAL-OFFER-BEHAVIOR>"
      "<SERVICE-OFFER-TIME-TO-LIVE>5</SERVICE-OFFER-TIME-TO-LIVE></SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG>"
      "<MACHINE-DESIGN><SHORT-NAME>Ecu</"
      "SHORT-NAME><COMMUNICATION-CONNECTORS><ETHERNET-COMMUNICATION-CONNECTOR>"
      "<SHORT-NAME>Eth</SHORT-NAME><AP-APPLICATION-ENDPOINTS><AP-APPLICATION-ENDPOINT><SHORT-NAME>T</"
      "SHORT-NAME>"
      "<TP-CONFIGURATION><TCP-TP><TCP-TP-PORT><PORT-NUMBER>30502</PORT-NUMBER></TCP-TP-PORT></TCP-TP>"
      "</TP-CONFIGURATION></AP-APPLICATION-ENDPOINT></"
      "AP-APPLICATION-ENDPOINTS><UNICAST-NETWORK-ENDPOINT-REFS>"
      "<UNICAST-NETWORK-ENDPOINT-REF DEST=\"X\">/P/Net/Ch/A</UNICAST-NETWORK-ENDPOINT-REF>"
      "</UNICAST-NETWORK-ENDPOINT-REFS></ETHERNET-COMMUNICATION-CONNECTOR></COMMUNICATION-CONNECTORS>"
      "<SERVICE-DISCOVERY-CONFIGS><SOMEIP-SERVICE-DISCOVERY><MULTICAST-SD-IP-ADDRESS-REF "
      "DEST=\"X\">/P/Net/Ch/M"
      "</MULTICAST-SD-IP-ADDRESS-REF><SOMEIP-SERVICE-DISCOVERY-PORT>30490</SOMEIP-SERVICE-DISCOVERY-PORT>"
      "</SOMEIP-SERVICE-DISCOVERY></SERVICE-DISCOVERY-CONFIGS></MACHINE-DESIGN>"
      "<ETHERNET-CLUSTER><SHORT-NAME>Net</"
      "SHORT-NAME><ETHERNET-CLUSTER-VARIANTS><ETHERNET-CLUSTER-CONDITIONAL>"
      "<PHYSICAL-CHANNELS><ETHERNET-PHYSICAL-CHANNEL><SHORT-NAME>Ch</"
      "SHORT-NAME><NETWORK-ENDPOINTS><NETWORK-ENDPOINT>"
      "<SHORT-NAME>A</SHORT-NAME><NETWORK-ENDPOINT-ADDRESSES><IPV-4-CONFIGURATION><IPV-4-ADDRESS>10.0.0.1"
      "</IPV-4-ADDRESS></IPV-4-CONFIGURATION></NETWORK-ENDPOINT-ADDRESSES></"
      "NETWORK-ENDPOINT><NETWORK-ENDPOINT>"
      "<SHORT-NAME>M</SHORT-NAME><NETWORK-ENDPOINT-ADDRESSES><IPV-4-CONFIGURATION><IPV-4-ADDRESS>224.0.0.5"
      "</IPV-4-ADDRESS></IPV-4-CONFIGURATION></NETWORK-ENDPOINT-ADDRESSES></NETWORK-ENDPOINT></"
      "NETWORK-ENDPOINTS>"
      "</ETHERNET-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></ETHERNET-CLUSTER-CONDITIONAL></"
      "ETHERNET-CLUSTER-VARIANTS>"
      "</ETHERNET-CLUSTER><SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING><SHORT-NAME>Here</SHORT-NAME>"
      "<COMMUNICATION-CONNECTOR-REF "
      "DEST=\"X\">/P/Ecu/Eth</COMMUNICATION-CONNECTOR-REF><SERVICE-INSTANCE-REFS>"
      "<SERVICE-INSTANCE-REF DEST=\"X\">/P/Left</SERVICE-INSTANCE-REF></SERVICE-INSTANCE-REFS>"
      "<TCP-PORT-REF DEST=\"X\">/P/Ecu/Eth/T</TCP-PORT-REF><UDP-PORT>30501</UDP-PORT>"
      "</SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.instances.size(), 2U);
  const Instance& left = reading.model.instances[0];
  EXPECT_EQ(left.service, "/P/Door");
  EXPECT_EQ(left.id, someip::InstanceId{7});
  EXPECT_EQ(left.address, IpAddress::v4(10, 0, 0, 1));
  EXPECT_EQ(left.udp_port, 30501);
  EXPECT_EQ(left.tcp_port, 30502);
  EXPECT_EQ(left.machine, "Ecu");
  EXPECT_EQ(left.timing->initial_delay_max, 50ms);
  EXPECT_EQ(left.timing->ttl_s, 5U);
  EXPECT_EQ(left.configuration.at("side"), "left");
  EXPECT_THAT(left.multicast, ElementsAre(Multicast{.eventgroup = someip::EventgroupId{3},
                                                    .group = {IpAddress::v4(239, 0, 0, 9), 30600},
                                                    .threshold = 4}));
  EXPECT_EQ(reading.model.instances[1].role, Instance::Role::required);
  EXPECT_FALSE(reading.model.instances[1].id.has_value());
  EXPECT_EQ(reading.model.machines[0].sd_multicast, IpAddress::v4(224, 0, 0, 5));
}

TEST(ReadArxml, ReadsWhatAClientAsksOfVersionsAndSubscriptions) {
  const auto required = [](std::string_view name, std::string_view inner) {
    return "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF DEST=\"X\">/P/Dep"
           "</SERVICE-INTERFACE-DEPLOYMENT-REF>" +
           std::string{inner} + "</REQUIRED-SOMEIP-SERVICE-INSTANCE>";
  };
  const std::string minor = "<REQUIRED-MINOR-VERSION>1</REQUIRED-MINOR-VERSION>";
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP><SHORT-NAME>G</SHORT-NAME>"
      "<EVENT-GROUP-ID>1</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>" +
      required("Exact", minor + "<VERSION-DRIVEN-FIND-BEHAVIOR>EXACT-OR-ANY-MINOR-VERSION"
                                "</VERSION-DRIVEN-FIND-BEHAVIOR>") +
      required("Least",
               "<BLOCKLISTED-VERSIONS><SOMEIP-SERVICE-VERSION><MAJOR-VERSION>2</MAJOR-VERSION>"
               "<MINOR-VERSION>0</MINOR-VERSION></SOMEIP-SERVICE-VERSION></BLOCKLISTED-VERSIONS>"
               "<REQUIRED-EVENT-GROUPS><SOMEIP-REQUIRED-EVENT-GROUP><SHORT-NAME>r</SHORT-NAME>"
               "<EVENT-GROUP-REF DEST=\"X\">/P/Dep/G</EVENT-GROUP-REF>"
               "<SD-CLIENT-EVENT-GROUP-TIMING-CONFIG-REF DEST=\"X\">/P/Tc"
               "</SD-CLIENT-EVENT-GROUP-TIMING-CONFIG-REF></SOMEIP-REQUIRED-EVENT-GROUP>"
               "</REQUIRED-EVENT-GROUPS>" +
                   minor +
                   "<VERSION-DRIVEN-FIND-BEHAVIOR>MINIMUM-MINOR-VERSION</VERSION-DRIVEN-FIND-BEHAVIOR>") +
      "<SOMEIP-SD-CLIENT-EVENT-GROUP-TIMING-CONFIG><SHORT-NAME>Tc</SHORT-NAME><TIME-TO-LIVE>7</TIME-TO-LIVE>"
      "</SOMEIP-SD-CLIENT-EVENT-GROUP-TIMING-CONFIG>")});
  ASSERT_EQ(reading.model.instances.size(), 2U);
  EXPECT_EQ(reading.model.instances[0].minor, 1U);
  const Instance& least = reading.model.instances[1];
  EXPECT_FALSE(least.minor.has_value()) << "Find cannot ask for at least 1";
  ASSERT_TRUE(least.timing.has_value());
  EXPECT_EQ(least.timing->ttl_s, 7U);
  EXPECT_THAT(problems_of(reading), HasSubstr("wants a minor version of at least 1"));
  EXPECT_THAT(problems_of(reading), HasSubstr("BLOCKLISTED-VERSIONS of /P/Least is not carried"));
}

TEST(ReadArxml, ReadsTheVersionAndSubscriptionsOfOldRequiredInstances) {
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP><SHORT-NAME>G</SHORT-NAME>"
      "<EVENT-GROUP-ID>1</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
      "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Old</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
      "DEST=\"X\">/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><REQUIRED-EVENT-GROUPS>"
      "<SOMEIP-REQUIRED-EVENT-GROUP><SHORT-NAME>r</SHORT-NAME><EVENT-GROUP-REF DEST=\"X\">/P/Dep/G"
      "</EVENT-GROUP-REF><SD-CLIENT-EVENT-TIMING-CONFIG><TIME-TO-LIVE>9</TIME-TO-LIVE>"
      "</SD-CLIENT-EVENT-TIMING-CONFIG></SOMEIP-REQUIRED-EVENT-GROUP></REQUIRED-EVENT-GROUPS>"
      "<REQUIRED-SERVICE-VERSION><MAJOR-VERSION>3</MAJOR-VERSION><MINOR-VERSION>4</MINOR-VERSION>"
      "</REQUIRED-SERVICE-VERSION></REQUIRED-SOMEIP-SERVICE-INSTANCE>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Instance& old = reading.model.instances.at(0);
  EXPECT_EQ(old.major, 3);
  EXPECT_EQ(old.minor, 4U);
  ASSERT_TRUE(old.timing.has_value());
  EXPECT_EQ(old.timing->ttl_s, 9U);
}

TEST(ReadArxml, ReadsInstancesOfTheFirstReleases) {
  // R17-10: the reference to the deployment has another name, groups are at the mapping, machines are whole.
  const std::string text = arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP><SHORT-NAME>G</SHORT-NAME>"
      "<EVENT-GROUP-ID>1</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>0x1234</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
      "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Left</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Dep</SERVICE-INTERFACE-REF><PROVIDED-EVENT-GROUPS><SOMEIP-PROVIDED-EVENT-GROUP><SHORT-NAME>g"
      "</SHORT-NAME><EVENT-GROUP-REF DEST=\"X\">/P/Dep/G</EVENT-GROUP-REF><MULTICAST-THRESHOLD>3"
      "</MULTICAST-THRESHOLD></SOMEIP-PROVIDED-EVENT-GROUP></PROVIDED-EVENT-GROUPS><SD-SERVER-CONFIG>"
      "<CAPABILITY-RECORDS><TAG-WITH-OPTIONAL-VALUE><KEY>side</KEY><VALUE>left</VALUE>"
      "</TAG-WITH-OPTIONAL-VALUE></CAPABILITY-RECORDS></SD-SERVER-CONFIG>"
      "<SERVICE-INSTANCE-ID>7</SERVICE-INSTANCE-ID></PROVIDED-SOMEIP-SERVICE-INSTANCE>"
      "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Any</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF></REQUIRED-SOMEIP-SERVICE-INSTANCE>"
      "<MACHINE><SHORT-NAME>Ecu</SHORT-NAME><COMMUNICATION-CONNECTORS><ETHERNET-COMMUNICATION-CONNECTOR>"
      "<SHORT-NAME>Eth</SHORT-NAME><UNICAST-NETWORK-ENDPOINT-REF DEST=\"X\">/P/Net/Ch/A"
      "</UNICAST-NETWORK-ENDPOINT-REF></ETHERNET-COMMUNICATION-CONNECTOR></COMMUNICATION-CONNECTORS></"
      "MACHINE>"
      "<ETHERNET-CLUSTER><SHORT-NAME>Net</SHORT-NAME><ETHERNET-CLUSTER-VARIANTS>"
      "<ETHERNET-CLUSTER-CONDITIONAL><PHYSICAL-CHANNELS><ETHERNET-PHYSICAL-CHANNEL><SHORT-NAME>Ch"
      "</SHORT-NAME><NETWORK-ENDPOINTS><NETWORK-ENDPOINT><SHORT-NAME>A</SHORT-NAME>"
      "<NETWORK-ENDPOINT-ADDRESSES><IPV-4-CONFIGURATION><IPV-4-ADDRESS>10.0.0.1</IPV-4-ADDRESS>"
      "</IPV-4-CONFIGURATION></NETWORK-ENDPOINT-ADDRESSES></NETWORK-ENDPOINT></NETWORK-ENDPOINTS>"
      "</ETHERNET-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></ETHERNET-CLUSTER-CONDITIONAL>"
      "</ETHERNET-CLUSTER-VARIANTS></ETHERNET-CLUSTER>"
      "<SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING><SHORT-NAME>M</SHORT-NAME>"
      "<COMMUNICATION-CONNECTOR-REF DEST=\"X\">/P/Ecu/Eth</COMMUNICATION-CONNECTOR-REF>"
      "<SERVICE-INSTANCE-REF DEST=\"X\">/P/Left</SERVICE-INSTANCE-REF>"
      "<EVENT-MULTICAST-UDP-PORT>30600</EVENT-MULTICAST-UDP-PORT>"
      "<IPV-4-MULTICAST-IP-ADDRESS>239.0.0.9</IPV-4-MULTICAST-IP-ADDRESS><UDP-PORT>30501</UDP-PORT>"
      "</SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING>");
  const Reading reading = read_texts({text});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.instances.size(), 2U);
  const Instance& left = reading.model.instances[0];
  EXPECT_EQ(left.service, "/P/Door");
  EXPECT_EQ(left.service_id, someip::ServiceId{0x1234});
  EXPECT_EQ(left.machine, "Ecu");
  EXPECT_EQ(left.address, IpAddress::v4(10, 0, 0, 1));
  EXPECT_EQ(left.configuration.at("side"), "left");
  EXPECT_THAT(left.multicast, ElementsAre(Multicast{.eventgroup = someip::EventgroupId{1},
                                                    .group = {IpAddress::v4(239, 0, 0, 9), 30600},
                                                    .threshold = 3}));
  EXPECT_EQ(reading.model.instances[1].service, "/P/Door");
  ASSERT_EQ(reading.model.machines.size(), 1U);
  EXPECT_EQ(reading.model.machines[0].address, IpAddress::v4(10, 0, 0, 1));
}

TEST(ReadArxml, ReadsHowLongMessagesAreCollected) {
  const auto props = [](std::string_view kind, std::string_view reference, std::string_view path,
                        std::string_view time) {
    return "<SOMEIP-" + std::string{kind} + "-PROPS><COLLECTION-PROPS><UDP-COLLECTION-BUFFER-TIMEOUT>" +
           std::string{time} + "</UDP-COLLECTION-BUFFER-TIMEOUT></COLLECTION-PROPS><" +
           std::string{reference} + " DEST=\"X\">" + std::string{path} + "</" + std::string{reference} +
           "></SOMEIP-" + std::string{kind} + "-PROPS>";
  };
  const Reading reading = read_texts({arxml(
      service("<EVENTS>" + event("a", "/x/uint8") + event("b", "/x/uint8") +
              "</EVENTS><FIELDS><FIELD><SHORT-NAME>f</SHORT-NAME><TYPE-TREF DEST=\"X\">/x/uint8</TYPE-TREF>"
              "</FIELD></FIELDS><METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>m</SHORT-NAME>"
              "</CLIENT-SERVER-OPERATION></METHODS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>ea</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/a</EVENT-REF>"
      "</SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><FIELD-DEPLOYMENTS><SOMEIP-FIELD-DEPLOYMENT><SHORT-NAME>"
      "df</SHORT-NAME><FIELD-REF DEST=\"X\">/P/Door/f</FIELD-REF><NOTIFIER><SHORT-NAME>n</SHORT-NAME>"
      "</NOTIFIER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS><METHOD-DEPLOYMENTS>"
      "<SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>dm</SHORT-NAME><METHOD-REF DEST=\"X\">/P/Door/m</METHOD-REF>"
      "</SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS><SERVICE-INTERFACE-REF DEST=\"X\">/P/Door"
      "</SERVICE-INTERFACE-REF><SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID>"
      "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>I</SHORT-NAME>"
      "<SERVICE-INTERFACE-DEPLOYMENT-REF DEST=\"X\">/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><EVENT-PROPSS>" +
      props("EVENT", "EVENT-REF", "/P/Dep/ea", "0.005") +
      props("EVENT", "EVENT-REF", "/P/Dep/df/n", "0.006") + "</EVENT-PROPSS><METHOD-RESPONSE-PROPSS>" +
      props("METHOD", "METHOD-REF", "/P/Dep/dm", "0.007") +
      "</METHOD-RESPONSE-PROPSS></PROVIDED-SOMEIP-SERVICE-INSTANCE>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Service& door = reading.model.services.at(0);
  EXPECT_EQ(door.events.at(0).transfer.retention, 5ms);
  EXPECT_EQ(door.events.at(1).transfer.retention, 0ms);
  EXPECT_EQ(door.fields.at(0).notifier_transfer.retention, 6ms);
  EXPECT_EQ(door.methods.at(0).response_transfer.retention, 7ms);
  EXPECT_EQ(door.methods.at(0).request_transfer.retention, 0ms);
}

TEST(ReadArxml, WarnsOfInstancesOfNoService) {
  const Reading reading = read_texts(
      {arxml("<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>A</SHORT-NAME></PROVIDED-SOMEIP-SERVICE-INSTANCE>"
             "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>B</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
             "DEST=\"X\">/P/A</SERVICE-INTERFACE-DEPLOYMENT-REF></PROVIDED-SOMEIP-SERVICE-INSTANCE>")});
  EXPECT_THAT(problems_of(reading), HasSubstr("/P/A names no deployment"));
  EXPECT_THAT(problems_of(reading), HasSubstr("/P/A is a PROVIDED-SOMEIP-SERVICE-INSTANCE, and a "
                                              "SOMEIP-SERVICE-INTERFACE-DEPLOYMENT was expected"));
}

TEST(ReadArxml, TellsOnceWhichPartsItDoesNotRead) {
  const auto event_deployment = [](std::string_view name) {
    return "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><ADMIN-DATA><SDGS/></ADMIN-DATA><EVENT-REF DEST=\"X\">/P/Door/" + std::string{name} +
           "</EVENT-REF><BURST-SIZE>3</BURST-SIZE></SOMEIP-EVENT-DEPLOYMENT>";
  };
  const Reading reading = read_texts(
      {arxml(service("<EVENTS>" + event("a", "/x/uint8") + event("b", "/x/uint8") + "</EVENTS>") +
             "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>" +
             event_deployment("a") + event_deployment("b") +
             "</EVENT-DEPLOYMENTS><SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
             "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  const std::string problems = problems_of(reading);
  EXPECT_THAT(problems, HasSubstr("BURST-SIZE of SOMEIP-EVENT-DEPLOYMENT is not read"));
  EXPECT_EQ(std::ranges::count(problems, '\n'), 1) << problems;
}

}  // namespace
}  // namespace trestle::describe
