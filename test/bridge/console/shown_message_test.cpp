#include "bridge/console/shown_message.hpp"

#include <gmock/gmock.h>

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

#include "bridge/console/sight.hpp"
#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/messages/values/cdr.hpp"
#include "bridge/messages/values/message_values.hpp"
#include "test/bytes.hpp"

namespace trestle::console {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

/// A message of the type that a text describes, as DDS or SOME/IP carries it.
ShownMessage shown(const std::string& type, const std::string& yaml, bool is_cdr = true,
                   const messages::MessageRules& rules = {}) {
  messages::TypeLibrary types;
  ShownMessage result{
      .route = "/seen", .type = type, .tree = *types.resolve(type), .rules = rules, .newest = {}};
  const auto values = messages::MessageValues::make(result.tree, rules);
  const auto bytes = is_cdr ? values->parse_sample(yaml, messages::ValueForm::yaml)
                            : values->parse(yaml, messages::ValueForm::yaml);
  EXPECT_TRUE(bytes) << yaml;
  result.newest = std::make_shared<carry::SeenMessage>(
      carry::SeenMessage{.is_cdr = is_cdr, .bytes = *bytes, .size = bytes->size(), .at_ns = 4711});
  return result;
}

struct Seen {
  nlohmann::json about;
  std::string bytes;
  [[nodiscard]] float number(std::size_t index) const {
    float result = 0;
    std::memcpy(&result, bytes.data() + index * sizeof result, sizeof result);
    return result;
  }
};
Seen see(const ShownMessage& message) {
  const std::string text = sight(message);
  std::uint32_t size = 0;
  std::memcpy(&size, text.data(), sizeof size);
  EXPECT_EQ(size % 4, 0U) << "floats lie where a Float32Array can begin";
  return {nlohmann::json::parse(text.substr(4, size)), text.substr(4 + size)};
}

TEST(ShownMessage, HasValuesAndWhatItsBytesAre) {
  for (const bool is_cdr : {true, false}) {
    const auto json = nlohmann::json::parse(
        message_json(shown("geometry_msgs/msg/Point", "{x: 1.5, y: -2, z: 3}", is_cdr)));
    EXPECT_EQ(json["route"], "/seen");
    EXPECT_EQ(json["size"], 24);
    EXPECT_EQ(json["at_ns"], 4711);
    EXPECT_EQ(json["values"], "x: 1.5\ny: -2.0\nz: 3.0\n");
    ASSERT_THAT(json["layout"], SizeIs(3));
    EXPECT_EQ(json["layout"][1]["path"], "y");
    EXPECT_EQ(json["layout"][1]["offset"], "8");
    EXPECT_EQ(json["layout"][1]["hex"], "c0 00 00 00 00 00 00 00");
    EXPECT_EQ(json["layout"][1]["value"], "-2");
    EXPECT_FALSE(json.contains("fault"));
  }
}

TEST(ShownMessage, HasTheBytesOfItsWireRules) {
  messages::MessageRules rules;
  rules.payload.byte_order = std::endian::little;
  const auto json =
      nlohmann::json::parse(message_json(shown("geometry_msgs/msg/Point", "{y: -2}", true, rules)));
  EXPECT_EQ(json["layout"][1]["hex"], "00 00 00 00 00 00 00 c0");
}

TEST(ShownMessage, SaysWhatIsWrongWithIt) {
  ShownMessage message = shown("geometry_msgs/msg/Point", "{}", false);
  message.newest = std::make_shared<carry::SeenMessage>(
      carry::SeenMessage{.bytes = test::hex("3ff8000000000000 01"), .size = 9});
  const auto json = nlohmann::json::parse(message_json(message));
  EXPECT_THAT(json["fault"].get<std::string>(), HasSubstr("y"));
  EXPECT_EQ(json["layout"][0]["value"], "1.5") << "what comes before that place";
  EXPECT_FALSE(json.contains("values"));
}

TEST(ShownMessage, SaysThatItIsTooLargeOrNotThere) {
  ShownMessage message = shown("geometry_msgs/msg/Point", "{}");
  message.newest =
      std::make_shared<carry::SeenMessage>(carry::SeenMessage{.bytes = {}, .size = 1'000'000'000});
  EXPECT_THAT(message_json(message), HasSubstr("it is too large to be shown"));
  message.newest = nullptr;
  EXPECT_EQ(message_json(message), R"({"route":"/seen","type":"geometry_msgs/msg/Point"})");
}

TEST(ShownMessage, IsCutWhereItIsLong) {
  std::string list = "{points: [";
  for (int i = 0; i < 1000; ++i) {
    list += "{x: 1},";
  }
  const std::string json = message_json(shown("geometry_msgs/msg/Polygon", list + "]}"));
  EXPECT_THAT(nlohmann::json::parse(json)["layout"], SizeIs(most_shown_ranges));
  EXPECT_GT(nlohmann::json::parse(json)["more_ranges"], 1000);
  EXPECT_LT(json.size(), 200'000U);
}

/// A route that maps fields: half degrees and quarters of an ECU become a NavSatFix, and back.
ShownMessage mapped(bool is_cdr, const std::vector<std::byte>& bytes) {
  messages::TypeLibrary types;
  types.define(*messages::interface_name("car_msgs/msg/Gnss"), "int32 lat\nint32 lon\nuint8 counter\n");
  ShownMessage result;
  result.route = "/fix";
  result.type = "sensor_msgs/msg/NavSatFix";
  result.tree = *types.resolve(result.type);
  result.map.emplace();
  result.map->payload = *types.resolve("car_msgs/msg/Gnss");
  messages::FieldMapping& mapping = result.map->mapping;
  mapping.payload.text = "car_msgs/msg/Gnss";
  mapping.others_default = true;
  mapping.dropped.resize(1);
  mapping.dropped[0].text = "counter";
  mapping.rules.resize(2);
  mapping.rules[0].ros.text = "latitude";
  mapping.rules[0].payload.text = "lat";
  mapping.rules[0].scale = 0.5;
  mapping.rules[1].ros.text = "longitude";
  mapping.rules[1].payload.text = "lon";
  mapping.rules[1].scale = 0.25;
  result.newest = std::make_shared<carry::SeenMessage>(
      carry::SeenMessage{.is_cdr = is_cdr, .bytes = bytes, .size = bytes.size(), .at_ns = 4711});
  return result;
}
/// 48.5 degrees north, 9.25 east, as CDR.
std::vector<std::byte> fix_cdr(std::endian order) {
  messages::CdrWriter out{256, order};
  out.number(std::uint32_t{0});  // header: stamp, frame_id
  out.number(std::uint32_t{0});
  out.number(std::uint32_t{1});
  out.number(std::uint8_t{0});
  out.number(std::uint8_t{0});  // status
  out.number(std::uint16_t{0});
  out.number(messages::bits_of(48.5));
  out.number(messages::bits_of(9.25));
  out.zeros(10, 8);  // altitude, covariance
  out.number(std::uint8_t{0});
  return out.take();
}

TEST(MappedMessage, HasTheBytesOfThePayloadAndTheValuesOfTheTopic) {
  const auto payload = test::hex("00000061 00000025 00");
  for (const auto& message : {mapped(false, payload), mapped(true, fix_cdr(std::endian::little)),
                              mapped(true, fix_cdr(std::endian::big))}) {
    const auto json = nlohmann::json::parse(message_json(message));
    EXPECT_FALSE(json.contains("fault")) << json["fault"];
    EXPECT_EQ(json["type"], "sensor_msgs/msg/NavSatFix");
    EXPECT_EQ(json["payload_type"], "car_msgs/msg/Gnss");
    EXPECT_EQ(json["size"], 9);
    EXPECT_THAT(json["values"].get<std::string>(), HasSubstr("\nlatitude: 48.5\nlongitude: 9.25\n"));
    ASSERT_THAT(json["layout"], SizeIs(3));
    EXPECT_EQ(json["layout"][1]["path"], "lon");
    EXPECT_EQ(json["layout"][1]["hex"], "00 00 00 25");
    EXPECT_EQ(json["layout"][1]["value"], "37");
    const auto seen = see(message);
    EXPECT_EQ(seen.about["latitude"], 48.5);
    EXPECT_EQ(seen.about["longitude"], 9.25);
  }
}

TEST(MappedMessage, SaysWhatIsWrongWithIt) {
  const auto json = nlohmann::json::parse(message_json(mapped(false, test::hex("00000061 0000"))));
  EXPECT_THAT(json["fault"].get<std::string>(), HasSubstr("lon"));
  EXPECT_EQ(json["layout"][0]["value"], "97");
}

constexpr const char* two_points =
    "{header: {frame_id: lidar}, height: 1, width: 2, point_step: 16, row_step: 32, fields: ["
    "{name: x, offset: 0, datatype: 7, count: 1}, {name: y, offset: 4, datatype: 7, count: 1},"
    "{name: z, offset: 8, datatype: 7, count: 1}, {name: intensity, offset: 12, datatype: 4, count: 1}], ";

TEST(Sight, OfACloudAreItsPoints) {
  const auto seen = see(shown("sensor_msgs/msg/PointCloud2", std::string{two_points} +
                                                                 "data: 'hex:0000803f0000004000004040ff000000"
                                                                 "0000a0400000c0400000e04001010000'}"));
  EXPECT_EQ(seen.about["kind"], "cloud");
  EXPECT_EQ(seen.about["points"], 2);
  EXPECT_EQ(seen.about["sent"], 2);
  EXPECT_EQ(seen.about["every"], 1);
  EXPECT_EQ(seen.about["value"], "intensity");
  EXPECT_EQ(seen.about["frame"], "lidar");
  ASSERT_THAT(seen.bytes, SizeIs(32));
  EXPECT_EQ(seen.number(0), 1);
  EXPECT_EQ(seen.number(2), 3);
  EXPECT_EQ(seen.number(3), 255);
  EXPECT_EQ(seen.number(6), 7);
  EXPECT_EQ(seen.number(7), 257);
}

TEST(Sight, LeavesOutPointsThatAreNowhere) {
  const auto seen = see(shown("sensor_msgs/msg/PointCloud2", std::string{two_points} +
                                                                 "data: 'hex:0000c07f000000400000404000000000"
                                                                 "0000a0400000c0400000e04000000000'}"));
  EXPECT_EQ(seen.about["not_finite"], 1);
  EXPECT_EQ(seen.about["sent"], 1);
  EXPECT_EQ(seen.number(0), 5);
}

TEST(Sight, OfALargeCloudIsEverySecondPoint) {
  ShownMessage message =
      shown("sensor_msgs/msg/PointCloud2",
            "{height: 2, width: 200000, point_step: 12, row_step: 2400000, fields: ["
            "{name: x, offset: 0, datatype: 7, count: 1}, {name: y, offset: 4, datatype: 7, count: 1},"
            "{name: z, offset: 8, datatype: 7, count: 1}], data: []}");
  carry::SeenMessage large = *message.newest;
  const std::uint32_t data = most_points * 2 * 12;
  large.bytes.resize(large.bytes.size() - 5);  // the count of `data`, and `is_dense`
  for (const unsigned shift : {0U, 8U, 16U, 24U}) {
    large.bytes.push_back(static_cast<std::byte>(data >> shift));
  }
  large.bytes.resize(large.bytes.size() + data + 1);
  large.size = large.bytes.size();
  message.newest = std::make_shared<carry::SeenMessage>(std::move(large));
  const Seen seen = see(message);
  EXPECT_EQ(seen.about["points"], 400'000);
  EXPECT_EQ(seen.about["every"], 2);
  EXPECT_EQ(seen.about["sent"], 200'000);
  EXPECT_EQ(seen.about["value"], "");
}

TEST(Sight, DoesNotReadBeyondTheData) {
  const std::string fields =
      "fields: [{name: x, offset: 0, datatype: 7, count: 1}, {name: y, offset: 4, datatype: 7, count: 1},"
      "{name: z, offset: 8, datatype: 7, count: 1}], data: [1, 2, 3]}";
  for (const char* const sizes :
       {"{height: 1, width: 1, point_step: 12, row_step: 12, ",
        "{height: 1, width: 1, point_step: 0, row_step: 0, ",
        "{height: 4294967295, width: 4294967295, point_step: 12, row_step: 4294967295, ",
        "{height: 4294967295, width: 1, point_step: 4294967295, row_step: 0, "}) {
    EXPECT_EQ(see(shown("sensor_msgs/msg/PointCloud2", sizes + fields)).about["kind"], "none") << sizes;
  }
  for (const char* const picture :
       {"{height: 2, width: 2, step: 6, encoding: rgb8, data: [1, 2, 3]}",
        "{height: 1, width: 2, step: 3, encoding: rgb8, data: [1, 2, 3]}",
        "{height: 4294967295, width: 4294967295, step: 0, encoding: mono8, data: [1, 2, 3]}"}) {
    EXPECT_EQ(see(shown("sensor_msgs/msg/Image", picture)).about["kind"], "none") << picture;
  }
}

TEST(Sight, OfAPictureAreItsColours) {
  const auto seen =
      see(shown("sensor_msgs/msg/Image",
                "{height: 2, width: 1, step: 4, encoding: bgr8, data: [3, 2, 1, 0, 6, 5, 4, 0]}"));
  EXPECT_EQ(seen.about["kind"], "image");
  EXPECT_THAT(seen.bytes, ElementsAre(1, 2, 3, '\xff', 4, 5, 6, '\xff'));
  EXPECT_THAT(
      see(shown("sensor_msgs/msg/Image", "{height: 1, width: 1, step: 1, encoding: mono8, data: [7]}")).bytes,
      ElementsAre(7, 7, 7, '\xff'));
  EXPECT_THAT(see(shown("sensor_msgs/msg/Image",
                        "{height: 1, width: 1, step: 2, encoding: mono16, is_bigendian: 1, data: [7, 9]}"))
                  .bytes,
              ElementsAre(7, 7, 7, '\xff'));
  EXPECT_EQ(
      see(shown("sensor_msgs/msg/Image", "{height: 1, width: 1, step: 2, encoding: yuv422, data: [7, 9]}"))
          .about["why"],
      "pictures of encoding yuv422 are not shown");
}

TEST(Sight, OfALargePictureIsASmallerOne) {
  const auto seen = see(
      shown("sensor_msgs/msg/Image", "{height: 1200, width: 1000, step: 1000, encoding: mono8, data: 'hex:" +
                                         std::string(2'400'000, '0') + "'}"));
  EXPECT_EQ(seen.about["sent_width"], 500);
  EXPECT_EQ(seen.about["sent_height"], 600);
  EXPECT_THAT(seen.bytes, SizeIs(4 * 500 * 600));
}

TEST(Sight, OfACompressedPictureIsItsFile) {
  const auto seen = see(shown("sensor_msgs/msg/CompressedImage", "{format: jpeg, data: 'hex:ffd8ffe0'}"));
  EXPECT_EQ(seen.about["mime"], "image/jpeg");
  EXPECT_THAT(seen.bytes, StartsWith("\xff\xd8\xff\xe0"));
  EXPECT_EQ(
      see(shown("sensor_msgs/msg/CompressedImage", "{format: h264, data: 'hex:00000001'}")).about["why"],
      "pictures of format h264 are not shown");
}

TEST(Sight, OfAPositionAndOfFramesAreTheirNumbers) {
  const auto fix = see(shown("sensor_msgs/msg/NavSatFix",
                             "{status: {status: -1}, latitude: 48.5, longitude: 9.25, altitude: 300}"));
  EXPECT_EQ(fix.about["latitude"], 48.5);
  EXPECT_EQ(fix.about["longitude"], 9.25);
  EXPECT_EQ(fix.about["altitude"], 300);
  EXPECT_EQ(fix.about["status"], -1);
  const auto frames =
      see(shown("tf2_msgs/msg/TFMessage",
                "{transforms: [{header: {frame_id: map}, child_frame_id: car, transform: {translation: "
                "{x: 1, y: 2, z: 3}, rotation: {x: 0, y: 0, z: 0, w: 1}}}]}"));
  ASSERT_THAT(frames.about["transforms"], SizeIs(1));
  EXPECT_EQ(frames.about["transforms"][0]["parent"], "map");
  EXPECT_EQ(frames.about["transforms"][0]["child"], "car");
  EXPECT_EQ(frames.about["transforms"][0]["translation"], nlohmann::json({1.0, 2.0, 3.0}));
  EXPECT_EQ(frames.about["transforms"][0]["rotation"], nlohmann::json({0.0, 0.0, 0.0, 1.0}));
}

}  // namespace
}  // namespace trestle::console
