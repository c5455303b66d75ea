// Every payload that the serialiser of the CommonAPI SOME/IP runtime made of a known value is made and read
// by ours too. test/fixtures/commonapi_golden.jsonl holds them; where we differ on purpose, the test says
// why.
#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/source_dir.hpp"

namespace trestle::someip {
namespace {
using nlohmann::json;
using test::covers;
using test::hex;
using test::to_hex;

/// A parameter's type as the fixture names it, with what its deployment says beside the rules.
struct Parameter {
  std::string type;
  PayloadRules rules = commonapi_rules;
  std::size_t fixed_string_bytes = 0;
  std::size_t union_bytes = 0;
  int enum_bytes = 4;
};

/// The number behind some words, 0 if there is none: 16 for "fixed length " in "utf8 width 0, fixed length 16
/// bytes".
std::optional<std::uint8_t> number_after(const std::string& text, const std::string& words) {
  const std::size_t found = text.find(words);
  if (found == std::string::npos) {
    return std::nullopt;
  }
  return static_cast<std::uint8_t>(std::strtoul(text.c_str() + found + words.size(), nullptr, 10));
}

Parameter parameter(const json& vector) {
  Parameter result;
  result.type = vector.at("type");
  result.rules.byte_order = vector.at("endianness") == "le" ? std::endian::little : std::endian::big;
  const std::string words = vector.at("deployment");
  PayloadRules& rules = result.rules;
  if (words.starts_with("utf16")) {
    rules.string_encoding = words.starts_with("utf16le") ? StringEncoding::utf16le : StringEncoding::utf16be;
  }
  result.fixed_string_bytes = number_after(words, "fixed length ").value_or(0);
  result.union_bytes = number_after(words, "max length ").value_or(0);
  if (const auto bytes = number_after(words, "length width ")) {
    (result.type.starts_with("struct") ? rules.struct_length : rules.union_length) = FieldWidth{*bytes};
    rules.union_type = FieldWidth{number_after(words, "type width ").value_or(4)};
    rules.union_length_first = words.find("order type-length") == std::string::npos;
  } else if (const auto plain = number_after(words, "width ")) {
    rules.string_length = rules.array_length = FieldWidth{*plain};
    result.enum_bytes = *plain;
  }
  return result;
}

// The types of the fixture, as a description that one writer and one reader follow. A struct is a list of
// members.
const std::map<std::string, std::vector<std::pair<std::string, std::string>>> structs{
    {"struct{uint8,uint32}", {{"", "uint8"}, {"", "uint32"}}},
    {"time", {{"sec", "int32"}, {"nanosec", "uint32"}}},
    {"std_msgs/Header", {{"stamp", "time"}, {"frame_id", "string"}}},
    {"geometry_msgs/Point", {{"x", "float64"}, {"y", "float64"}, {"z", "float64"}}},
    {"status", {{"status", "int8"}, {"service", "uint16"}}},
    {"sensor_msgs/NavSatFix",
     {{"header", "std_msgs/Header"},
      {"status", "status"},
      {"latitude", "float64"},
      {"longitude", "float64"},
      {"altitude", "float64"},
      {"position_covariance", "float64[]"},
      {"position_covariance_type", "uint8"}}},
    {"field", {{"name", "string"}, {"offset", "uint32"}, {"datatype", "uint8"}, {"count", "uint32"}}},
    {"sensor_msgs/PointCloud2",
     {{"header", "std_msgs/Header"},
      {"height", "uint32"},
      {"width", "uint32"},
      {"fields", "field[]"},
      {"is_bigendian", "bool"},
      {"point_step", "uint32"},
      {"row_step", "uint32"},
      {"data", "uint8[]"},
      {"is_dense", "bool"}}}};
const std::vector<std::string> union_members{"uint8", "uint32", "string"};

/// "uint16[]" gives "uint16" and no size, "uint8[3]" gives "uint8" and 3.
struct ArrayType {
  std::string element;
  std::size_t fixed_size = 0;
};
std::optional<ArrayType> array_type(const std::string& type) {
  if (!type.ends_with(']')) {
    return std::nullopt;
  }
  const std::size_t bracket = type.rfind('[');
  return ArrayType{type.substr(0, bracket), number_after(type, "[").value_or(0)};
}

std::size_t union_member(const Parameter& p, const json& value) {
  // The fixture's names say which member: "variant ... uint8", all others hold a uint32.
  return p.type == "union" && value == 5 ? 0 : 1;
}

void write(PayloadWriter& out, const Parameter& p, const std::string& type, const json& value) {
  if (const auto array = array_type(type)) {
    const auto open = array->fixed_size == 0 ? out.begin_array() : out.begin_fixed_array();
    for (const json& element : value) {
      write(out, p, array->element, element);
    }
    out.end(open);
  } else if (structs.contains(type)) {
    const auto open = out.begin_struct();
    std::size_t i = 0;
    for (const auto& [name, member] : structs.at(type)) {
      write(out, p, member, value.is_array() ? value.at(i++) : value.at(name));
    }
    out.end(open);
  } else if (type.starts_with("union")) {
    const std::size_t member = union_member(p, value);
    const auto open = out.begin_union(static_cast<std::uint32_t>(member + 1), p.union_bytes);
    write(out, p, union_members[member], value);
    out.end(open);
  } else if (type == "string" && p.fixed_string_bytes != 0) {
    out.fixed_string(value.get<std::string>(), p.fixed_string_bytes);
  } else if (type == "string") {
    out.string(value.get<std::string>());
  } else if (type == "bool") {
    out.boolean(value);
  } else if (type == "int8") {
    out.i8(value);
  } else if (type == "uint8" || (type.starts_with("enum") && p.enum_bytes == 1)) {
    out.u8(value);
  } else if (type == "int16") {
    out.i16(value);
  } else if (type == "uint16" || (type.starts_with("enum") && p.enum_bytes == 2)) {
    out.u16(value);
  } else if (type == "int32" || type.starts_with("enum")) {
    out.i32(value);
  } else if (type == "uint32") {
    out.u32(value);
  } else if (type == "int64") {
    out.i64(value);
  } else if (type == "uint64") {
    out.u64(value);
  } else if (type == "float32") {
    out.f32(value);
  } else if (type == "float64") {
    out.f64(value);
  } else {
    throw std::invalid_argument{"type " + type};
  }
}

json read(PayloadReader& in, const Parameter& p, const std::string& type) {
  std::array<char, 64> room{};
  if (const auto array = array_type(type)) {
    json result = json::array();
    auto open = array->fixed_size == 0 ? in.begin_array() : in.begin_fixed_array();
    while (array->fixed_size == 0 ? in.more(open) : result.size() < array->fixed_size) {
      result.push_back(read(in, p, array->element));
    }
    in.end(open);
    return result;
  }
  if (structs.contains(type)) {
    json result;
    const auto open = in.begin_struct();
    for (const auto& [name, member] : structs.at(type)) {
      if (name.empty()) {
        result.push_back(read(in, p, member));
      } else {
        result[name] = read(in, p, member);
      }
    }
    in.end(open);
    return result;
  }
  if (type.starts_with("union")) {
    const auto open = in.begin_union(static_cast<std::uint32_t>(union_members.size()), p.union_bytes);
    if (open.type == 0) {
      return nullptr;
    }
    json result = read(in, p, union_members[open.type - 1]);
    in.end(open.open);
    return result;
  }
  if (type == "string") {
    return std::string{p.fixed_string_bytes != 0 ? in.fixed_string(p.fixed_string_bytes, room)
                                                 : in.string(room)};
  }
  if (type == "bool") {
    return in.boolean();
  }
  if (type == "int8") {
    return in.i8();
  }
  if (type == "uint8" || (type.starts_with("enum") && p.enum_bytes == 1)) {
    return in.u8();
  }
  if (type == "int16") {
    return in.i16();
  }
  if (type == "uint16" || (type.starts_with("enum") && p.enum_bytes == 2)) {
    return in.u16();
  }
  if (type == "int32" || type.starts_with("enum")) {
    return in.i32();
  }
  if (type == "uint32") {
    return in.u32();
  }
  if (type == "int64") {
    return in.i64();
  }
  if (type == "uint64") {
    return in.u64();
  }
  if (type == "float32") {
    return in.f32();
  }
  if (type == "float64") {
    return in.f64();
  }
  throw std::invalid_argument{"type " + type};
}

struct Written {
  std::string hex;
  std::optional<WireError> error;
};

Written written(const Parameter& p, const json& value) {
  std::vector<std::byte> room(1024);
  PayloadWriter out{room, p.rules};
  write(out, p, p.type, value);
  const auto payload = out.finish();
  return payload ? Written{to_hex(*payload), std::nullopt} : Written{"", payload.error()};
}

std::vector<json> vectors() {
  std::ifstream file{test::source_dir() + "/test/fixtures/commonapi_golden.jsonl"};
  std::vector<json> result;
  for (std::string line; std::getline(file, line);) {
    json vector = json::parse(line);
    if (vector.at("type") == "sensor_msgs/PointCloud2") {  // there the fixture says "bytes 0..31"
      vector["value"]["data"] = json::array();
      for (int i = 0; i < 32; ++i) {
        vector["value"]["data"].push_back(i);
      }
    }
    result.push_back(std::move(vector));
  }
  return result;
}

bool is_reading(const json& vector) {
  return vector.at("name").get<std::string>().starts_with("read:");
}

/// Faults of CommonAPI that we do not copy.
enum class Fault { none, false_for_true, unpadded_union, empty_for_too_long };

Fault fault(const json& vector) {
  if (vector.at("name") == "bool true" && vector.at("endianness") == "le") {
    return Fault::false_for_true;
  }
  if (vector.at("name") == "variant uint32 no length, max 8") {
    return Fault::unpadded_union;
  }
  if (vector.at("name") == "string fixed too long") {
    return Fault::empty_for_too_long;
  }
  return Fault::none;
}

TEST(CommonApiGolden, HasAllVectors) {
  EXPECT_EQ(vectors().size(), 117U);
}

TEST(CommonApiGolden, IsWhatWeWrite) {
  covers({"feat_req_someip_682", "feat_req_someip_237", "feat_req_someip_254", "feat_req_someip_264",
          "feat_req_someip_600"});
  std::size_t equal = 0;
  for (const json& vector : vectors()) {
    if (is_reading(vector) || !vector.at("ok").get<bool>() || fault(vector) != Fault::none) {
      continue;
    }
    EXPECT_EQ(written(parameter(vector), vector.at("value")).hex, vector.at("hex").get<std::string>())
        << vector;
    ++equal;
  }
  EXPECT_EQ(equal, 117U - 14U - 1U - 3U);
  // All but those that read, the one whose writer fails (too few elements: our caller counts them), three
  // faults.
}

TEST(CommonApiGolden, IsWhatWeReadAsTheValueItWasMadeOf) {
  std::size_t equal = 0;
  for (const json& vector : vectors()) {
    if (is_reading(vector) || !vector.at("ok").get<bool>() || fault(vector) != Fault::none) {
      continue;
    }
    const Parameter p = parameter(vector);
    const auto payload = hex(vector.at("hex").get<std::string>());
    PayloadReader in{payload, p.rules};
    EXPECT_EQ(read(in, p, p.type), vector.at("value")) << vector;
    EXPECT_EQ(in.error(), std::nullopt) << vector;
    EXPECT_EQ(in.position(), payload.size()) << vector;
    ++equal;
  }
  EXPECT_EQ(equal, 117U - 14U - 1U - 3U);
}

TEST(CommonApiGolden, IsNotCopiedWhereItIsWrong) {
  std::map<Fault, std::string> ours;
  for (const json& vector : vectors()) {
    if (fault(vector) != Fault::none) {
      const Written result = written(parameter(vector), vector.at("value"));
      ours[fault(vector)] = result.error ? to_string(*result.error) : result.hex;
    }
  }
  // Its little endian writer takes the wrong byte of a wider number and sends 00 for true.
  EXPECT_EQ(ours[Fault::false_for_true], "01");
  // Without a length field its reader, as the specification, expects the longest member's size, its writer
  // forgets the padding.  [feat_req_someip_583]
  EXPECT_EQ(ours[Fault::unpadded_union], "020000000600000000");
  // A string too long for its fixed size becomes an empty payload, and no error is reported.
  EXPECT_EQ(ours[Fault::empty_for_too_long], "bad_length");
  EXPECT_EQ(ours.size(), 3U);
}

TEST(CommonApiGolden, IsRefusedWhereItsReaderRefuses) {
  // Where its reader is more lenient than the bytes allow; all else must agree.
  const std::map<std::string, WireError> stricter{
      // The type names no member, so there is nothing that could be read.
      {"read:variant type 4", WireError::bad_union_type},
      // The members go on behind the length: one of the two is wrong.
      {"read:struct length 3 (too small)", WireError::bad_length}};
  std::size_t readings = 0;
  for (const json& vector : vectors()) {
    if (!is_reading(vector)) {
      continue;
    }
    ++readings;
    const Parameter p = parameter(vector);
    const auto payload = hex(vector.at("hex").get<std::string>());
    PayloadReader in{payload, p.rules};
    static_cast<void>(read(in, p, p.type));
    if (const auto exception = stricter.find(vector.at("name")); exception != stricter.end()) {
      EXPECT_EQ(in.error(), exception->second) << vector;
      EXPECT_TRUE(vector.at("accepted").get<bool>()) << vector;
    } else {
      EXPECT_EQ(!in.error(), vector.at("accepted").get<bool>()) << vector;
    }
  }
  EXPECT_EQ(readings, 14U);
}

}  // namespace
}  // namespace trestle::someip
