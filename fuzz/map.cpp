// Property: what a mapping of fields makes is a sample of the other type, and it is the same whether arrays
// are referenced or copied, and whatever came before; an error lies within the input.
//
// The first bit of an input chooses the direction.
#include <chrono>
#include <cstdint>
#include <utility>

#include "bridge/messages/map/map_compiler.hpp"
#include "fuzz/conversion_plans.hpp"

using namespace trestle;
using namespace trestle::fuzz;

namespace {

constexpr const char* payload_text =
    "Part[] parts\nuint8 mode\nbool on\nint16 level\nuint32[3] counts\nfloat32[] samples\nstring name\n"
    "wstring wide\nuint8 kind\nint64 stamp_us\nfloat64 span_s\nstring[] words\nuint16[] raw\nPart one\n";
constexpr const char* ros_text =
    "builtin_interfaces/Time stamp\nbuiltin_interfaces/Duration span\nbuiltin_interfaces/Time came\n"
    "float64 level\nint8 mode\nuint8 on\nuint16[3] counts\nuint32 last\nfloat64[<=20] samples\n"
    "string<=40 name\nwstring<=9 wide\nstring frame\nPart[<=5] parts\nstring<=12[<=4] words\nuint16[] raw\n"
    "string text\nfloat32 unsaid\n";

/// Every kind of rule, of every kind of field.
messages::FieldMapping mapping() {
  using messages::MapRule;
  messages::FieldMapping made;
  const auto rule = [&](const char* ros, const char* payload) -> MapRule& {
    MapRule& one = made.rules.emplace_back();
    one.ros.text = ros;
    one.payload.text = payload;
    return one;
  };
  rule("stamp", "stamp_us").unit = messages::TimeUnit::us;
  rule("span", "span_s").unit = messages::TimeUnit::s;
  rule("came", "").is_received = true;
  MapRule& level = rule("level", "level");
  level.scale = -0.5;
  level.offset = 300;
  MapRule& mode = rule("mode", "mode");
  for (const auto& [from, to] : {std::pair{"0", "-1"}, std::pair{"1", "0"}, std::pair{"200", "5"}}) {
    mode.table.push_back({{from, {}}, {to, {}}});
  }
  mode.otherwise = messages::Otherwise::keep;
  rule("on", "on");
  rule("counts", "counts");
  MapRule& last = rule("last", "counts[2]");
  last.only = messages::MapDirection::to_ros;
  rule("samples", "samples").scale = 1e-3;
  rule("name", "name");
  rule("wide", "wide");
  rule("frame", "").value = messages::MarkedText{"base", {}};
  rule("parts", "parts");
  rule("words", "words");
  rule("raw", "raw");
  rule("text", "one.text");
  messages::PayloadConstant kind;
  kind.payload.text = "kind";
  kind.value.text = "7";
  made.constants.push_back(kind);
  made.dropped.push_back({"one.id", {}});
  made.others_default = true;
  return made;
}

struct Way {
  messages::FieldMap map;
  messages::ConversionPlan plan;  ///< of the type that is made
};

Way way(messages::MapDirection direction) {
  messages::TypeLibrary library;
  library.define(*messages::interface_name("car_msgs/msg/Part"), "uint16 id\nstring text\n");
  library.define(*messages::interface_name("car_msgs/msg/Status"), payload_text);
  library.define(*messages::interface_name("car_msgs/msg/State"), ros_text);
  const messages::TypeTree payload = library.resolve("car_msgs/msg/Status").value();
  const messages::TypeTree ros = library.resolve("car_msgs/msg/State").value();
  auto compiled = messages::compile_map(payload, ros, mapping(), direction);
  require(compiled.map.has_value());
  const bool to_ros = direction == messages::MapDirection::to_ros;
  return {std::move(*compiled.map), messages::ConversionPlan::compile(to_ros ? ros : payload, {}).value()};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Way ways[] = {way(messages::MapDirection::to_ros), way(messages::MapDirection::to_payload)};
  if (size == 0) {
    return 0;
  }
  const Way& to = ways[data[0] & 1U];
  const ByteView sample = std::as_bytes(std::span{data, size}).subspan(1);
  const std::chrono::nanoseconds received{1'234'567'890};
  static messages::MapScratch scratch;
  messages::MapScratch fresh;
  messages::MapCounters counters;
  const auto made = to.map.convert(sample, received, 16, scratch, counters);
  const auto copied = to.map.convert(sample, received, SIZE_MAX, fresh, counters);
  require(made.has_value() == copied.has_value());
  if (!made) {
    require(made.error().fault == copied.error().fault && made.error().offset <= sample.size());
    return 0;
  }
  const auto first = whole(*made);
  require(whole(*copied) == first);
  messages::ConversionScratch plain;
  if (const auto payload = to.plan.cdr_to_someip(first, plain); !payload) {
    // A mapping copies texts, and does not look into them.
    const auto fault = payload.error().fault;
    require(fault == messages::ConversionFault::bad_encoding ||
            fault == messages::ConversionFault::bad_string);
  }
  return 0;
}
