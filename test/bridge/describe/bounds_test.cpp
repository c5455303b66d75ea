// Models that are larger, or deeper, than any that somebody writes. Each of these tests took minutes, or for
// ever, or all memory, before there was a limit or an index for it; none looks at a clock.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>

#include "bridge/describe/allocate.hpp"
#include "bridge/describe/compare.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/describe/lower.hpp"
#include "bridge/describe/model_json.hpp"
#include "bridge/describe/read/arxml/arxml.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "bridge/describe/read/vsomeip/read_vsomeip.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"
#include "bridge/describe/write/msg/write_msg.hpp"
#include "bridge/describe/write/routes/write_routes.hpp"
#include "bridge/describe/write/sheet/write_sheet.hpp"
#include "bridge/describe/write/vsomeip/write_vsomeip.hpp"
#include "bridge/describe/write/wireshark/write_wireshark.hpp"
#include "test/bridge/describe/arxml/arxml_text.hpp"
#include "test/bridge/describe/lost.hpp"
#include "test/sanitized.hpp"

namespace trestle::describe {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// Without optimisation even what is linear takes a while, and with a sanitizer a long one.
#ifdef __OPTIMIZE__
constexpr unsigned many = test::sanitized ? 1'000 : 30'000;
#else
constexpr unsigned many = test::sanitized ? 1'000 : 4'000;
#endif

std::vector<std::string> texts_of(const std::vector<documents::Problem>& all) {
  std::vector<std::string> texts;
  for (const documents::Problem& one : all) {
    texts.push_back(one.text);
  }
  return texts;
}

/// A service with one event that carries `value`.
void add_event(Model& model, Value value) {
  model.services.push_back({.name = "Door",
                            .scope = "car",
                            .id = someip::ServiceId{0x1234},
                            .events = {{.name = "moved",
                                        .id = someip::MethodId{0x8001},
                                        .payload = {.values = {std::move(value)}},
                                        .eventgroups = {someip::EventgroupId{1}}}},
                            .eventgroups = {{.id = someip::EventgroupId{1}}}});
  model.instances.push_back({.name = "car.Door",
                             .service = "car.Door",
                             .service_id = someip::ServiceId{0x1234},
                             .id = someip::InstanceId{1},
                             .udp_port = std::uint16_t{30501}});
}

/// S1 {S0 a S0 b}, S2 {S1 a S1 b} …: an event carries the last one.
Model doubled(Type lowest, someip::FieldWidth length_of_a = someip::FieldWidth::none) {
  Model model;
  lowest.name = "S0";
  lowest.scope = "car.Types";
  TypeIndex last = model.add(std::move(lowest));
  for (int level = 1; level <= 40; ++level) {
    last = model.add({.kind = Kind::structure,
                      .name = fmt::format("S{}", level),
                      .scope = "car.Types",
                      .members = {{.name = "a", .type = last, .wire = {.length = length_of_a}},
                                  {.name = "b", .type = last}}});
  }
  add_event(model, {.name = "all", .type = last});
  return model;
}

struct AllWritten {
  std::vector<NotCarried> lost;
  std::size_t bytes = 0;
};

/// All that can be done with a model.
AllWritten use_all(const Model& model) {
  AllWritten all;
  const auto take = [&](const Written& written) {
    for (const TextFile& file : written.files) {
      all.bytes += file.text.size();
    }
    all.lost.insert(all.lost.end(), written.not_carried.begin(), written.not_carried.end());
  };
  const Lowered lowered = lower(model);
  take(write_routes(model, lowered, {}));
  take(write_msg(model, lowered));
  take(write_fidl(model));
  take(write_vsomeip(model, {}));
  take(write_sheet(model));
  take(write_wireshark(model));
  const ArxmlFile arxml = write_arxml(model);
  all.bytes += arxml.text.size();
  all.lost.insert(all.lost.end(), arxml.not_carried.begin(), arxml.not_carried.end());
  all.bytes += to_json_text(model).size();
  EXPECT_THAT(compare(model, model), IsEmpty());
  return all;
}

TEST(Bounds, HoldForStructuresOfTwoStructuresOfTwoStructures) {
  const AllWritten of_bytes = use_all(doubled({.kind = Kind::primitive}));
  EXPECT_THAT(lines_of(of_bytes.lost),
              Contains("car.Door.moved: the rest of its bytes: more than 20000 ranges"));
  const AllWritten of_nothing = use_all(doubled({.kind = Kind::structure}));
  EXPECT_THAT(lines_of(of_nothing.lost),
              Contains("car.Door.moved: the rest of its bytes: more than 200000 uses of types"));
  // Each `a` has another length field than the `b` beside it: rules for each way to one.
  const AllWritten of_rules = use_all(doubled({.kind = Kind::structure}, someip::FieldWidth::bits8));
  EXPECT_THAT(lines_of(of_rules.lost), Contains(HasSubstr("with rules of their own: there are too many")));
}

TEST(Bounds, HoldForMapsOfMaps) {
  for (const bool has_names : {true, false}) {
    Model model;
    TypeIndex last = model.add({.kind = Kind::primitive});
    for (int level = 1; level <= 20; ++level) {
      last = model.add({.kind = Kind::map,
                        .name = has_names ? fmt::format("M{}", level) : std::string{},
                        .scope = "car.Types",
                        .element = {.type = last, .wire = default_wire(Kind::map)},
                        .key = {.type = last, .wire = default_wire(Kind::map)}});
    }
    add_event(model, {.name = "all", .type = last, .wire = default_wire(Kind::map)});
    const Lowered lowered = lower(model);
    if (has_names) {
      EXPECT_THAT(lowered.definitions, SizeIs(testing::Ge(20U)));
      EXPECT_THAT(
          lines_of(lowered.not_carried),
          Contains(testing::AllOf(HasSubstr("a bridge refuses it"), HasSubstr("more than 65536 fields"))));
    } else {
      EXPECT_THAT(lines_of(lowered.not_carried), Contains(HasSubstr("more than 1000 maps in maps")));
    }
    static_cast<void>(use_all(model));
  }
}

TEST(Bounds, HoldForPolymorphicTypesBesideDeepOnes) {
  Model model;
  model.add({.kind = Kind::structure, .name = "P", .polymorphic = true});
  model.add({.kind = Kind::structure, .name = "S", .members = {{.name = "p", .type = TypeIndex{0}}}});
  model.add({.kind = Kind::primitive});
  TypeIndex last{2};
  for (int level = 0; level < 60; ++level) {
    last = model.add({.kind = Kind::structure,
                      .name = fmt::format("L{}", level),
                      .members = {{.name = "m", .type = last}}});
  }
  add_event(model, {.name = "all", .type = last});
  add_event(model, {.name = "all", .type = TypeIndex{1}});
  // The depth is still right behind the polymorphic one.
  EXPECT_THAT(lines_of(lower(model).not_carried), Contains(HasSubstr("a polymorphic structure")));
  EXPECT_THAT(lower(model).definitions,
              Contains(::testing::Field(&messages::MessageDefinition::name, HasSubstr("/L20"))));
}

/// 30,000 of everything.
Model large() {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive});
  for (unsigned i = 0; i < many; ++i) {
    const TypeIndex type =
        model.add({.kind = Kind::structure,
                   .name = fmt::format("T{}", i),
                   .scope = fmt::format("car.Types{}", i % 100),
                   .members = {{.name = "a", .type = number}, {.name = "b", .type = number}}});
    const TypeIndex unnamed = model.add({.kind = Kind::array,
                                         .wire = default_wire(Kind::array),
                                         .element = {.type = type},
                                         .max_size = i + 1});
    model.constants.push_back({fmt::format("C{}", i), number, "1", fmt::format("car.Types{}", i % 100)});
    const std::string name = fmt::format("S{}", i);
    model.services.push_back(
        {.name = name,
         .scope = "car",
         .id = someip::ServiceId{static_cast<std::uint16_t>(i + 1)},
         .events =
             {{.name = "moved",
               .id = someip::MethodId{0x8001},
               .payload = {.values = {{.name = "all", .type = unnamed, .wire = default_wire(Kind::array)}}},
               .eventgroups = {someip::EventgroupId{1}}}},
         .methods = {{.name = "go",
                      .id = someip::MethodId{1},
                      .request = {.values = {{.name = "all", .type = type}}}}},
         .eventgroups = {{.id = someip::EventgroupId{1}}}});
    model.instances.push_back({.name = "car." + name,
                               .service = "car." + name,
                               .service_id = someip::ServiceId{static_cast<std::uint16_t>(i + 1)},
                               .id = someip::InstanceId{1},
                               .address = IpAddress::v4(10, 0, 0, 1),
                               .udp_port = std::uint16_t{30501}});
  }
  return model;
}

TEST(Bounds, LetLargeModelsThrough) {
  Model model = large();
  EXPECT_THAT(join(model), IsEmpty());
  IdLock lock;
  EXPECT_THAT(allocate_ids(model, lock), IsEmpty());
  EXPECT_GT(use_all(model).bytes, std::size_t{many} * 1000);
  Model other = model;
  for (Service& service : other.services) {
    service.name += "x";  // paired by id
  }
  for (Instance& instance : other.instances) {
    instance.service += "x";
  }
  EXPECT_THAT(compare(model, other), SizeIs(many));
}

TEST(Bounds, LetLargeFilesThrough) {
  Model model = large();
  std::vector<SourceText> fidl;
  for (TextFile& file : write_fidl(model).files) {
    fidl.push_back({file.path, std::move(file.text)});
  }
  const Load none = [](const std::string&) { return tl::unexpected{std::string{"none"}}; };
  const Reading of_fidl = read_sources(fidl, none);
  EXPECT_TRUE(of_fidl.ok());
  EXPECT_THAT(of_fidl.model.services, SizeIs(many));
  const Reading of_arxml = read_sources(std::vector{SourceText{"a.arxml", write_arxml(model).text}}, none);
  EXPECT_TRUE(of_arxml.ok());
  EXPECT_THAT(of_arxml.model.services, SizeIs(many));
  std::vector<SourceText> vsomeip;
  for (TextFile& file : write_vsomeip(model, {}).files) {
    vsomeip.push_back({file.path, std::move(file.text)});
  }
  const Reading of_vsomeip = read_sources(vsomeip, none);
  EXPECT_TRUE(of_vsomeip.ok());
  EXPECT_THAT(of_vsomeip.model.services, SizeIs(many));
}

TEST(Bounds, LetOneLargeServiceThrough) {
  Model model;
  Type colours{.kind = Kind::enumeration,
               .name = "Colour",
               .scope = "car.Types",
               .primitive = messages::Primitive::uint16};
  Type record{.kind = Kind::structure, .name = "Record", .scope = "car.Types"};
  Type either{
      .kind = Kind::choice, .name = "Either", .scope = "car.Types", .wire = default_wire(Kind::choice)};
  for (unsigned i = 0; i < many; ++i) {
    colours.enumerators.push_back({fmt::format("c{}", i), i});
    record.members.push_back({.name = fmt::format("m{}", i), .type = TypeIndex{0}});
    either.members.push_back({.name = fmt::format("m{}", i), .type = TypeIndex{0}});
  }
  model.add(std::move(colours));
  const TypeIndex one = model.add(std::move(record));
  const TypeIndex other = model.add(std::move(either));
  const TypeIndex number = model.add({.kind = Kind::primitive});
  add_event(model, {.name = "all", .type = one});
  Service& door = model.services.front();
  for (unsigned i = 2; i < many; ++i) {
    const auto id = static_cast<std::uint16_t>(i);
    door.events.push_back(
        {.name = fmt::format("e{}", i),
         .id = someip::MethodId{static_cast<std::uint16_t>(0x8000U + i)},
         .payload = {.values = {{.name = "all", .type = i % 2'000 == 0 ? TypeIndex{0} : number}}},
         .eventgroups = {someip::EventgroupId{id}}});
    door.methods.push_back(
        {.name = fmt::format("m{}", i),
         .id = someip::MethodId{id},
         .request = {.values = {{.name = "all",
                                 .type = i % 2'000 == 0 ? other : number,
                                 .wire = default_wire(i % 2'000 == 0 ? Kind::choice : Kind::primitive)}}}});
    door.eventgroups.push_back({.id = someip::EventgroupId{id}});
    model.instances.push_back({.name = fmt::format("i{}", i),
                               .service = i % 2 == 0 ? "car.Door" : "no.Door",
                               .id = someip::InstanceId{1}});
  }
  EXPECT_THAT(join(model), IsEmpty());
  EXPECT_GT(use_all(model).bytes, std::size_t{many} * 100);
}

TEST(Bounds, RefuseLongLinesOfBases) {
  Model model;
  model.add({.kind = Kind::structure, .name = "T0"});
  for (unsigned i = 1; i < many; ++i) {
    model.add({.kind = Kind::structure, .name = fmt::format("T{}", i), .base = TypeIndex{i - 1}});
  }
  EXPECT_THAT(texts_of(join(model)), Contains("types are nested more than 200 deep"));
  // A line that goes round has no end.
  model.types[0].base = TypeIndex{many - 1};
  EXPECT_THAT(all_members(model, model.types[5]), IsEmpty());
}

TEST(Bounds, RefuseMembersThatAreInheritedAgainAndAgain) {
  Model model;
  Type base{.kind = Kind::structure, .name = "Base", .place = {.mark = {1, 1}}};
  for (unsigned i = 0; i < 1000; ++i) {
    base.members.push_back({.name = fmt::format("m{}", i), .type = TypeIndex{1}});
  }
  model.add(std::move(base));
  model.add({.kind = Kind::primitive});
  for (int i = 0; i < 1001; ++i) {
    model.add({.kind = Kind::structure, .base = TypeIndex{0}, .place = {.mark = {i + 2, 1}}});
  }
  const std::vector<documents::Problem> problems = join(model);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_EQ(problems[0].text, "types have inherited more than 1000000 members up to here");
  EXPECT_EQ(problems[0].mark.line, 1002);
}

TEST(Bounds, RefuseInterfacesThatInheritTooMuch) {
  std::string fidl = "package a\ninterface Base { version { major 1 minor 0 }\n";
  for (unsigned i = 0; i < 1000; ++i) {
    fidl += fmt::format("method m{} {{}}\n", i);
  }
  fidl += "}\n";
  for (unsigned i = 0; i < 10'000; ++i) {
    fidl += fmt::format("interface I{} extends Base {{ version {{ major 1 minor 0 }} }}\n", i);
  }
  const Load none = [](const std::string&) { return tl::unexpected{std::string{"none"}}; };
  const Reading reading = read_sources(std::vector{SourceText{"a.fidl", fidl}}, none);
  EXPECT_FALSE(reading.ok());
  EXPECT_THAT(texts_of(reading.problems),
              Contains("interfaces have inherited more than 200000 members and arguments up to here"));
}

TEST(Bounds, RefuseInterfacesThatInheritTooManyArguments) {
  std::string fidl = "package a\ninterface Base { version { major 1 minor 0 }\nmethod m { in {\n";
  for (unsigned i = 0; i < 1000; ++i) {
    fidl += fmt::format("UInt8 a{}\n", i);
  }
  fidl += "} } }\n";
  for (unsigned i = 0; i < 1000; ++i) {
    fidl += fmt::format("interface I{} extends Base {{ version {{ major 1 minor 0 }} }}\n", i);
  }
  const Load none = [](const std::string&) { return tl::unexpected{std::string{"none"}}; };
  const Reading reading = read_sources(std::vector{SourceText{"a.fidl", fidl}}, none);
  EXPECT_THAT(texts_of(reading.problems),
              Contains("interfaces have inherited more than 200000 members and arguments up to here"));
}

std::string list_of(unsigned count, const std::function<std::string(unsigned)>& one) {
  std::string all;
  for (unsigned i = 0; i < count; ++i) {
    all += one(i);
  }
  return all;
}

std::string element(std::string_view tag, std::string_view name, std::string_view inner) {
  return fmt::format("<{0}><SHORT-NAME>{1}</SHORT-NAME>{2}</{0}>\n", tag, name, inner);
}

/// Two lists of 200, of which one is copied for each element of the other.
constexpr unsigned listed = 200;
constexpr std::size_t copied = 5'000;
constexpr const char* told_copies =
    "what several elements refer to is copied for each of them, and up to here these are more than 5000 "
    "members, arguments, enumerators and errors";

std::string listed_events(std::string_view type) {
  return "<EVENTS>" + list_of(listed, [&](unsigned i) { return event(fmt::format("e{}", i), type); }) +
         "</EVENTS>";
}

std::string many_deployments() {
  return list_of(listed,
                 [](unsigned i) {
                   return element("SOMEIP-SERVICE-INTERFACE-DEPLOYMENT", fmt::format("D{}", i),
                                  "<SERVICE-INTERFACE-REF DEST=\"SERVICE-INTERFACE\">/P/Door"
                                  "</SERVICE-INTERFACE-REF>");
                 }) +
         service(listed_events("/x/uint8"));
}

std::string many_errors() {
  return service("<METHODS>" +
                 list_of(listed,
                         [](unsigned i) {
                           return element("CLIENT-SERVER-OPERATION", fmt::format("m{}", i),
                                          "<POSSIBLE-AP-ERROR-SET-REFS><POSSIBLE-AP-ERROR-SET-REF "
                                          "DEST=\"X\">/P/Set</POSSIBLE-AP-ERROR-SET-REF>"
                                          "</POSSIBLE-AP-ERROR-SET-REFS>");
                         }) +
                 "</METHODS>") +
         element("AP-APPLICATION-ERROR-SET", "Set",
                 "<AP-APPLICATION-ERROR-REFS>" + list_of(listed, [](unsigned i) {
                   return fmt::format(
                       "<AP-APPLICATION-ERROR-REF DEST=\"X\">/P/E{}"
                       "</AP-APPLICATION-ERROR-REF>",
                       i);
                 }) + "</AP-APPLICATION-ERROR-REFS>");
}

/// A structure of which each event has one member by rules of its own.
std::string many_variants() {
  const std::string members = list_of(listed, [](unsigned i) {
    return element(
        "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT", fmt::format("m{}", i),
        "<CATEGORY>TYPE_REFERENCE</CATEGORY><TYPE-REFERENCE><TYPE-REFERENCE-REF DEST=\"X\">/x/String"
        "</TYPE-REFERENCE-REF></TYPE-REFERENCE>");
  });
  const std::string rules = list_of(listed, [](unsigned i) {
    return element("SOMEIP-DATA-PROTOTYPE-TRANSFORMATION-PROPS", fmt::format("o{}", i),
                   fmt::format("<DATA-PROTOTYPES><DATA-PROTOTYPE-IN-SERVICE-INTERFACE-REF>"
                               "<ELEMENT-IN-IMPL-DATATYPE><ROOT-DATA-PROTOTYPE-REF DEST=\"X\">/P/Door/e{0}"
                               "</ROOT-DATA-PROTOTYPE-REF><TARGET-DATA-PROTOTYPE-REF DEST=\"X\">/P/T/m{0}"
                               "</TARGET-DATA-PROTOTYPE-REF></ELEMENT-IN-IMPL-DATATYPE>"
                               "</DATA-PROTOTYPE-IN-SERVICE-INTERFACE-REF></DATA-PROTOTYPES>"
                               "<SOMEIP-TRANSFORMATION-PROPS-REF DEST=\"X\">/P/Set/Short"
                               "</SOMEIP-TRANSFORMATION-PROPS-REF>",
                               i));
  });
  return element("STD-CPP-IMPLEMENTATION-DATA-TYPE", "T",
                 "<CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>" + members + "</SUB-ELEMENTS>") +
         element("TRANSFORMATION-PROPS-SET", "Set",
                 "<TRANSFORMATION-PROPSS>" +
                     element("AP-SOMEIP-TRANSFORMATION-PROPS", "Short",
                             "<SIZE-OF-STRING-LENGTH-FIELD>1</SIZE-OF-STRING-LENGTH-FIELD>") +
                     "</TRANSFORMATION-PROPSS>") +
         service(listed_events("/P/T")) + rules;
}

std::string texts_of_values() {
  return element("COMPU-METHOD", "C",
                 "<CATEGORY>TEXTTABLE</CATEGORY><COMPU-INTERNAL-TO-PHYS><COMPU-SCALES>" +
                     list_of(listed,
                             [](unsigned i) {
                               return fmt::format(
                                   "<COMPU-SCALE><LOWER-LIMIT>{0}</LOWER-LIMIT><UPPER-LIMIT>{0}"
                                   "</UPPER-LIMIT><COMPU-CONST><VT>V{0}</VT></COMPU-CONST>"
                                   "</COMPU-SCALE>",
                                   i);
                             }) +
                     "</COMPU-SCALES></COMPU-INTERNAL-TO-PHYS>");
}

/// Members, or types, that all have the names of one COMPU-METHOD.
std::string many_with_texts(std::string_view tag) {
  return list_of(listed, [&](unsigned i) {
    return element(
        tag, fmt::format("m{}", i),
        "<CATEGORY>VALUE</CATEGORY>" + props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>"
                                             "<COMPU-METHOD-REF DEST=\"X\">/P/C</COMPU-METHOD-REF>"));
  });
}

TEST(Bounds, RefuseWhatIsCopiedAgainAndAgainInArxml) {
  for (const std::string& text :
       {many_deployments(), many_errors(), many_variants(),
        std::string{base_types} + texts_of_values() + many_with_texts("IMPLEMENTATION-DATA-TYPE")}) {
    const Reading reading = read_texts({arxml(text)}, {.max_copies = copied});
    ASSERT_THAT(reading.problems, Contains(testing::Field(&documents::Problem::text, told_copies)))
        << text.substr(0, 100) << problems_of(reading);
    const auto told = std::ranges::find(reading.problems, told_copies, &documents::Problem::text);
    EXPECT_GT(told->mark.line, 1);
    EXPECT_TRUE(read_texts({arxml(text)}).ok()) << problems_of(read_texts({arxml(text)}));
  }
}

TEST(Bounds, BuildAnEnumerationOfManyMembersOnce) {
  const std::string text =
      std::string{base_types} + texts_of_values() +
      element("IMPLEMENTATION-DATA-TYPE", "T",
              "<CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>" +
                  many_with_texts("IMPLEMENTATION-DATA-TYPE-ELEMENT") + "</SUB-ELEMENTS>") +
      service(listed_events("/P/T"));
  const Reading reading = read_texts({arxml(text)}, {.max_copies = 0});
  EXPECT_TRUE(reading.ok()) << problems_of(reading);
  EXPECT_THAT(reading.model.types, SizeIs(2));
}

TEST(Bounds, RefuseLongPathsInArxml) {
  const std::string name(1000, 'p');
  std::string text = element("STD-CPP-IMPLEMENTATION-DATA-TYPE", "T", "<CATEGORY>VALUE</CATEGORY>");
  for (int deep = 0; deep < 4; ++deep) {
    text = deep == 0 ? element("AR-PACKAGE", name, "<ELEMENTS>" + text + "</ELEMENTS>")
                     : element("AR-PACKAGE", name, "<AR-PACKAGES>" + text + "</AR-PACKAGES>");
  }
  const Reading reading =
      read_texts({std::string{arxml_head} + "<AR-PACKAGES>" + text + "</AR-PACKAGES></AUTOSAR>"});
  EXPECT_THAT(problems_of(reading),
              HasSubstr("the path of this element has 4004 bytes; expected at most 4000"));
}

TEST(Bounds, RefuseWhatIsCopiedAgainAndAgainInFidl) {
  const std::string fidl =
      "package v\ninterface V { version { major 1 minor 0 }\nstruct S {\n" +
      list_of(listed, [](unsigned i) { return fmt::format("String m{}\n", i); }) + "}\n" +
      list_of(listed, [](unsigned i) { return fmt::format("attribute S a{}\n", i); }) + "}\n";
  const std::string fdepl =
      "import \"CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\nimport \"V.fidl\"\n"
      "define org.genivi.commonapi.someip.deployment for interface v.V { SomeIpServiceID = 1\n" +
      list_of(listed,
              [](unsigned i) {
                return fmt::format(
                    "attribute a{0} {{ #struct {{ m{0} {{ SomeIpStringLengthWidth = 1 }} }} }}\n", i);
              }) +
      "}\n";
  const std::vector<SourceText> files{{"V.fidl", fidl}, {"V.fdepl", fdepl}};
  EXPECT_TRUE(read_fidl(files).ok());
  const Reading reading = read_fidl(files, {}, {.copies = copied});
  const auto told = std::ranges::find(reading.problems, told_copies, &documents::Problem::text);
  ASSERT_NE(told, reading.problems.end()) << problems_of(reading);
  EXPECT_EQ(told->file, "V.fdepl");
  EXPECT_EQ(told->mark.line, 3 + 26);  // 25 structures of 200 members are no more than 5000
}

TEST(Bounds, CountTheConstantsOfEnumerations) {
  Model model;
  Type colours{.kind = Kind::enumeration, .name = "Colour"};
  for (unsigned i = 0; i < 100; ++i) {
    colours.enumerators.push_back({fmt::format("c{}", i), i});
  }
  model.add(std::move(colours));
  for (unsigned i = 0; i < 1000; ++i) {
    model.add({.kind = Kind::structure,
               .name = fmt::format("T{}", i),
               .members = {{.name = "a", .type = TypeIndex{0}}, {.name = "b", .type = TypeIndex{0}}}});
  }
  const Lowered lowered = lower(model, {.max_constants = 20'000});
  std::size_t constants = 0;
  for (const messages::MessageDefinition& definition : lowered.definitions) {
    constants += definition.constants.size();
  }
  EXPECT_EQ(constants, 20'000U);
  EXPECT_THAT(lines_of(lowered.not_carried),
              Contains("T200: the enumerators of Colour as constants: there are more than 20000"));
}

TEST(Bounds, EndAComparisonOfCircles) {
  // Circles of 199 and 200 types, each of two members of the next: together 39,800 pairs.
  const auto circle = [](unsigned length) {
    Model model;
    for (unsigned i = 0; i < length; ++i) {
      const TypeIndex next{(i + 1) % length};
      model.add({.kind = Kind::structure,
                 .name = "T",
                 .members = {{.name = "a", .type = next}, {.name = "b", .type = next}}});
    }
    add_event(model, {.name = "all", .type = TypeIndex{0}});
    return model;
  };
  const std::vector<Change> changes = compare(circle(199), circle(200));
  ASSERT_THAT(changes, ::testing::Not(IsEmpty()));
  EXPECT_EQ(changes.front().rule->id, "not-compared");
}

}  // namespace
}  // namespace trestle::describe
