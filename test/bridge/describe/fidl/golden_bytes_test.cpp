// The bytes of CommonAPI's runtime come out of FIDL and FDEPL: each line's type and deployment are written as
// an interface of CommonAPI, which is read again.
#include <fmt/format.h>

#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "test/bridge/describe/golden.hpp"

namespace trestle::describe::golden_bytes_test {
namespace {

using golden::json;
using golden::number_behind;

/// An interface in parts.
struct Interface {
  std::string types{};     ///< declarations in FIDL
  std::string of_types{};  ///< their deployment
  std::string value{};     ///< type of the argument
  std::string of_value{};  ///< its deployment
  int version = 2;         ///< of CommonAPI's deployment specification
};

std::string key(const char* name, std::optional<std::uint32_t> number) {
  return number ? fmt::format("{} = {}\n", name, *number) : "";
}

std::string franca_name(const std::string& type) {
  static const std::map<std::string, std::string> names{
      {"bool", "Boolean"},  {"int8", "Int8"},     {"uint8", "UInt8"},    {"int16", "Int16"},
      {"uint16", "UInt16"}, {"int32", "Int32"},   {"uint32", "UInt32"},  {"int64", "Int64"},
      {"uint64", "UInt64"}, {"float32", "Float"}, {"float64", "Double"}, {"string", "String"}};
  return names.at(type);
}

/// Those of ROS, as somebody would write them for CommonAPI.
constexpr const char* ros_types = R"(
  struct Time { Int32 sec UInt32 nanosec }
  struct Header { Time stamp String frame_id }
  struct Point { Double x Double y Double z }
  struct NavSatStatus { Int8 status UInt16 service }
  struct NavSatFix { Header header NavSatStatus status Double latitude Double longitude Double altitude
    Double[] position_covariance UInt8 position_covariance_type }
  struct PointField { String name UInt32 offset UInt8 datatype UInt32 count }
  struct PointCloud2 { Header header UInt32 height UInt32 width PointField[] fields Boolean is_bigendian
    UInt32 point_step UInt32 row_step ByteBuffer data Boolean is_dense }
)";

Interface interface_of(const json& line) {
  const std::string type = line["type"];
  const std::string deployment = line["deployment"];
  const std::string name = line["name"];
  const auto width = number_behind(deployment, "width ");
  Interface made;
  if (type.ends_with("]")) {
    const bool is_buffer = name.starts_with("bytebuffer");
    const char* const stem = is_buffer ? "ByteBuffer" : "Array";
    made.value = is_buffer ? "ByteBuffer" : franca_name(type.substr(0, type.find('['))) + "[]";
    made.of_value = key(fmt::format("SomeIp{}LengthWidth", stem).c_str(), width) +
                    key(fmt::format("SomeIp{}MinLength", stem).c_str(), number_behind(deployment, "min ")) +
                    key(fmt::format("SomeIp{}MaxLength", stem).c_str(), number_behind(deployment, "max "));
  } else if (type == "string") {
    made.value = "String";
    made.of_value = key("SomeIpStringLengthWidth", width) +
                    key("SomeIpStringLength", number_behind(deployment, "fixed length "));
    for (const char* encoding : {"utf16le", "utf16be"}) {
      made.of_value +=
          deployment.starts_with(encoding) ? fmt::format("SomeIpStringEncoding = {}\n", encoding) : "";
    }
  } else if (type.starts_with("enum:")) {
    made.types = "enumeration Level { LOW = 1 HIGH = 3 }";
    made.value = "Level";
    made.of_types = fmt::format("enumeration Level {{ EnumBackingType = {}\n{} }}",
                                franca_name(type.substr(5)), key("SomeIpEnumWidth", width));
    // A generator of CommonAPI always has a deployment; by version 1 it is as wide as without one.
    made.version = width ? 2 : 1;
  } else if (type.starts_with("struct{")) {
    made.types = "struct Pair { UInt8 a UInt32 b }";
    made.value = "Pair";
    made.of_types = fmt::format("struct Pair {{ {} }}", key("SomeIpStructLengthWidth", width));
  } else if (type.starts_with("union")) {
    made.types = "union Choice { UInt8 a UInt32 b String c }";
    made.value = "Choice";
    made.of_types = fmt::format(
        "union Choice {{ {}{}{}{} }}",
        key("SomeIpUnionLengthWidth", number_behind(deployment, "length width ")),
        key("SomeIpUnionTypeWidth", number_behind(deployment, "type width ")),
        key("SomeIpUnionMaxLength", number_behind(deployment, "max length ")),
        deployment.find("type-length") != std::string::npos ? "SomeIpUnionDefaultOrder = false" : "");
  } else if (type.find('/') != std::string::npos) {
    made.types = ros_types;
    made.value = type.substr(type.find('/') + 1);
  } else {
    made.value = franca_name(type);
  }
  return made;
}

Reading imported(const json& line) {
  const Interface made = interface_of(line);
  const std::string fidl = fmt::format(
      "package org.test\ninterface Door {{\nversion {{ major 1 minor 0 }}\n{}\nbroadcast changed {{ out {{ "
      "{} value }} "
      "}}\n}}\n",
      made.types, made.value);
  const std::string fdepl = fmt::format(
      "import "
      "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI{}-SOMEIP_deployment_spec.fdepl\"\n"
      "import \"Door.fidl\"\n"
      "define org.genivi.commonapi.someip.deployment for interface org.test.Door {{\nSomeIpServiceID = "
      "0x1234\n{}\n"
      "broadcast changed {{ SomeIpEventID = 0x8001\nSomeIpEventGroups = {{ 1 }}\nSomeIpBroadcastEndianess = "
      "{}\n"
      "out {{ ^value {{ {} }} }} }}\n}}\n",
      made.version == 2 ? "-4" : "", made.of_types, line["endianness"].get<std::string>(), made.of_value);
  const SourceText source{"Door.fdepl", fdepl};
  return read_fidl(std::span{&source, 1},
                   [&](const std::string&) -> tl::expected<std::string, std::string> { return fidl; });
}

TEST(GoldenBytes, OfCommonApiComeOutOfFidlAndFdepl) {
  const auto all = golden::lines();
  ASSERT_GT(all.size(), 100U);
  std::size_t compared = 0;
  for (json line : all) {
    SCOPED_TRACE(line.dump());
    if (golden::is_exception(line)) {
      continue;
    }
    if (line["name"] == "variant uint32 no length, max 8") {
      // A fault of that runtime: it means to fill up to SomeIpUnionMaxLength, and writes nothing. It does not
      // read such a payload itself; what it reads is filled.
      line["hex"] = line["hex"].get<std::string>() + "00000000";
    }
    const Reading reading = imported(line);
    for (const documents::Problem& problem : reading.problems) {
      ADD_FAILURE() << documents::to_string(problem);
    }
    golden::compare(line, reading.model);
    ++compared;
  }
  EXPECT_GE(compared, all.size() - 3);
}

}  // namespace
}  // namespace trestle::describe::golden_bytes_test
