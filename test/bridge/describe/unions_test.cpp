// Unions of every kind of member, from FIDL to each target and back.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"

namespace trestle::describe {
namespace {

using ::testing::IsEmpty;

/// What is on the wire, and the names of members.
std::string shape(const Model& model, const Value& value) {
  const Type& type = resolved(model, value.type);
  const std::string length = fmt::format("{}:{}", to_string(type.kind), static_cast<int>(value.wire.length));
  switch (type.kind) {
    case Kind::primitive:
      return messages::to_string(type.primitive);
    case Kind::enumeration:
      return fmt::format("{} {}", type.name, messages::to_string(type.primitive));
    case Kind::array:
      return fmt::format("{}({})", length, shape(model, type.element));
    case Kind::map:
      return fmt::format("{}({}, {})", length, shape(model, type.key), shape(model, type.element));
    case Kind::structure:
    case Kind::choice: {
      std::string text = fmt::format("{} {}(", length, type.name);
      for (const Value& member : all_members(model, type)) {
        text += fmt::format("{} {}, ", member.name, shape(model, member));
      }
      return fmt::format("{}) {}", text, fmt::join(type.selectors, " "));
    }
    default:
      return length;
  }
}

/// Of the unions by name.
std::vector<std::string> unions(const Reading& reading) {
  for (const documents::Problem& problem : reading.problems) {
    EXPECT_NE(problem.severity, documents::Problem::Severity::error) << problem.text;
  }
  std::vector<std::string> all;
  for (const Type& type : reading.model.types) {
    if (type.kind == Kind::choice) {
      const auto at = static_cast<std::uint32_t>(&type - reading.model.types.data());
      all.push_back(shape(reading.model, {.type = TypeIndex{at}, .wire = type.wire}));
    }
  }
  std::ranges::sort(all);
  return all;
}

Reading read(const std::vector<SourceText>& files) {
  return read_sources(files, [](const std::string&) { return tl::unexpected{std::string{"is not there"}}; });
}

const Reading& from_fidl() {
  static const Reading reading = read({{"Car.fidl", R"(package car
interface Door {
  version { major 1 minor 0 }
  array Names of String
  array Rows of Names
  typedef Speed is UInt16
  typedef Many is Names
  struct Part { UInt8 x }
  typedef Piece is Part
  enumeration Side { LEFT RIGHT }
  map Places { UInt8 to String }
  typedef Map is Places
  union Whole {
    Names names
    Rows rows
    Speed speed
    Many many
    Piece piece
    Side side
    Places places
    Map map
    ByteBuffer bytes
    UInt8[] numbers
    Side[] sides
  }
  union Twice {
    UInt16 first
    UInt16 second
    Speed third
    Names names
    Many again
    UInt8[] few
  }
  union Nested { Twice one Twice other Whole whole }
  method open { in { Whole whole } out { Twice twice } }
  broadcast moved { out { Nested nested } }
}
)"}});
  return reading;
}

TEST(Unions, ComeBackFromFidl) {
  std::vector<SourceText> files;
  for (const TextFile& file : write_fidl(from_fidl().model).files) {
    files.push_back({file.path, file.text});
  }
  EXPECT_THAT(unions(from_fidl()), ::testing::SizeIs(3));
  EXPECT_EQ(unions(read(files)), unions(from_fidl()));
}

TEST(Unions, ComeBackFromArxml) {
  EXPECT_EQ(unions(read({{"car.arxml", write_arxml(from_fidl().model).text}})), unions(from_fidl()));
}

TEST(Unions, ComeBackFromMsgFilesByTheirMark) {
  const Lowered lowered = lower(from_fidl().model);
  EXPECT_THAT(lowered.not_carried, IsEmpty());
  std::vector<SourceText> files;
  for (const messages::MessageDefinition& one : lowered.definitions) {
    if (one.name.find("/msg/") != std::string::npos) {
      files.push_back({"/ws/" + one.name + ".msg", msg_text(lowered, one)});
    }
  }
  EXPECT_EQ(unions(read(files)), unions(from_fidl()));
}

TEST(Unions, OfMsgFilesAreStructuresWhereTheirMarkDoesNotFit) {
  const auto has_union = [](const std::string& text) {
    return !unions(read({{"/ws/car_msgs/msg/Any.msg", text}})).empty();
  };
  EXPECT_TRUE(has_union("# trestle: union\nuint8[<=1] a\nstring[<=1] b\n"));
  EXPECT_TRUE(has_union("# trestle: union 7 0\n\n# Of a.\nuint8[<=1] a\nstring[<=1] b\n"));
  EXPECT_FALSE(has_union("# trestle: union\nuint8[<=2] a\n"));
  EXPECT_FALSE(has_union("# trestle: union\nuint8[<=1] a\nuint8 b\n"));
  EXPECT_FALSE(has_union("# trestle: union\nuint8 A=1\n"));
  EXPECT_FALSE(has_union("# trestle: unions\nuint8[<=1] a\n"));
  EXPECT_FALSE(has_union("# trestle: union 1 1\nuint8[<=1] a\nuint8[<=1] b\n"));
  EXPECT_FALSE(has_union("# trestle: union 1\nuint8[<=1] a\nuint8[<=1] b\n"));
  EXPECT_FALSE(has_union("# trestle: union 1  2\nuint8[<=1] a\nuint8[<=1] b\n"));
  EXPECT_FALSE(has_union("# trestle: union x\nuint8[<=1] a\n"));
  EXPECT_FALSE(has_union("uint8[<=1] a\n# trestle: union\nuint8[<=1] b\n"));
}

}  // namespace
}  // namespace trestle::describe
