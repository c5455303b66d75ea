#include "bridge/messages/convert/quick/shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>

#include "test/allocations.hpp"
#include "test/bridge/messages/convert/cdr_walk.hpp"
#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/convert/random_message.hpp"
#include "test/bridge/messages/convert/type_rules.hpp"

namespace trestle::messages::shape_test {
namespace {

using namespace trestle::test;
using quick::Memory;
using quick::Shape;
using someip::PayloadRules;

const Shape::Conversion somewhere{.program = 1, .to_cdr = true, .order = std::endian::little, .position = 12};
constexpr std::size_t operations = Shape::least_operations;

/// So many bytes, each another one.
std::vector<std::byte> counted(std::size_t size) {
  std::vector<std::byte> bytes(size);
  std::generate(bytes.begin(), bytes.end(), [i = 0]() mutable { return static_cast<std::byte>(++i); });
  return bytes;
}

/// Of bytes that become themselves, with no numbers among them.
void record_same(Shape& shape, ByteView bytes, const Shape::Conversion& conversion = somewhere) {
  shape.begin(conversion, 0, 0, 0);
  if (shape.keep(operations, bytes.size(), bytes.size())) {
    shape.finish(bytes.data(), bytes.data());
  }
}

std::string written(const Shape& shape, ByteView input) {
  std::vector<std::byte> output(shape.writes());
  shape.write(input.data(), output.data());
  return to_hex(output);
}

TEST(Shape, IsOnlyWhatHasTheSameBytes) {
  for (const std::size_t size : {32U, 33U, 63U, 64U, 65U, 96U, 200U, 1024U}) {
    Shape shape;
    const auto bytes = counted(size);
    EXPECT_FALSE(shape.is(somewhere, bytes));
    record_same(shape, bytes);
    EXPECT_TRUE(shape.is(somewhere, bytes));
    EXPECT_EQ(shape.reads(), size);
    EXPECT_EQ(shape.end(), operations);
    EXPECT_EQ(written(shape, bytes), to_hex(bytes));
    EXPECT_TRUE(shape.is(somewhere, counted(size + 1)));  // something follows it
    EXPECT_FALSE(shape.is(somewhere, ByteView{bytes}.first(size - 1)));
    for (std::size_t i = 0; i < size; ++i) {
      for (const unsigned bit : {0U, 7U}) {
        auto other = bytes;
        other[i] ^= static_cast<std::byte>(1U << bit);
        EXPECT_FALSE(shape.is(somewhere, other)) << size << ' ' << i;
      }
    }
  }
}

TEST(Shape, DependsOnProgramDirectionOrderAndAlignment) {
  Shape shape;
  const auto bytes = counted(40);
  const auto is = [&](auto change) {
    auto conversion = somewhere;
    change(conversion);
    return shape.is(conversion, bytes);
  };
  record_same(shape, bytes);
  EXPECT_TRUE(is([](auto& /*nothing*/) {}));
  EXPECT_FALSE(is([](auto& other) { other.program = 2; }));
  EXPECT_FALSE(is([](auto& other) { other.to_cdr = false; }));
  EXPECT_FALSE(is([](auto& other) { other.order = std::endian::big; }));
  EXPECT_FALSE(is([](auto& other) { other.position = 13; }));
  EXPECT_FALSE(is([](auto& other) { other.position = 14; }));
  EXPECT_TRUE(is([](auto& other) { other.position = 16; }));  // counts are aligned to 4
  shape.begin(somewhere, 0, 0, 0);
  EXPECT_TRUE(shape.numbers(8, 8, 1, 8, false));
  EXPECT_TRUE(shape.keep(operations, 40, 40));
  shape.finish(bytes.data(), bytes.data());
  EXPECT_FALSE(is([](auto& other) { other.position = 16; }));
  EXPECT_TRUE(is([](auto& other) { other.position = 20; }));
}

TEST(Shape, PutsInTheNumbersOfEach) {
  Shape shape;
  // A byte, two numbers of 2, one of 4, one of 8 and three bytes, some of them in the other order; everything
  // but these is 0xee, and two bytes longer in the output. Places count from 100 and 200.
  const auto input = hex("01 eeee 0203 0405 ee 06070809 0a0b0c0d0e0f1011 121314 ee" + std::string(16, 'e'));
  const auto output =
      hex("ffff 01 eeee 0302 0504 ee 06070809 11100f0e0d0c0b0a 121314 ee" + std::string(16, 'e'));
  shape.begin(somewhere, 5, 100, 200);
  EXPECT_TRUE(shape.numbers(100, 202, 1, 1, false));
  EXPECT_TRUE(shape.numbers(103, 205, 2, 2, true));
  EXPECT_TRUE(shape.numbers(108, 210, 1, 4, false));
  EXPECT_TRUE(shape.numbers(112, 214, 1, 8, true));
  EXPECT_TRUE(shape.numbers(120, 222, 3, 1, false));
  EXPECT_TRUE(shape.keep(5 + operations, 100 + input.size(), output.size()));
  shape.finish(input.data(), output.data());
  EXPECT_EQ(shape.end(), 5 + operations);
  EXPECT_TRUE(shape.is(somewhere, input));
  EXPECT_EQ(written(shape, input), to_hex(output));
  // First one differs, then all, then what differed is as it was.
  auto other = input;
  const auto expect = [&](const std::string& numbers) {
    ASSERT_TRUE(shape.is(somewhere, other));
    EXPECT_EQ(written(shape, other), compact("ffff" + numbers + "ee" + std::string(16, 'e')));
  };
  other[19] = std::byte{0x99};
  expect("01 eeee 0302 0504 ee 06070809 99100f0e0d0c0b0a 121314");
  other[0] = other[4] = other[5] = other[11] = other[22] = std::byte{0x77};
  expect("77 eeee 7702 0577 ee 06070877 99100f0e0d0c0b0a 121377");
  other = input;
  expect("01 eeee 0302 0504 ee 06070809 11100f0e0d0c0b0a 121314");
  // Everything around them still counts.
  for (const std::size_t i : {1U, 2U, 7U, 23U, 31U}) {
    auto bad = input;
    bad[i] = std::byte{0xef};
    EXPECT_FALSE(shape.is(somewhere, bad)) << i;
  }
}

TEST(Shape, DoesNotLookAtPadding) {
  Shape shape;
  const auto bytes = counted(40);
  shape.begin(somewhere, 0, 60, 0);
  shape.padding(63, 66);
  EXPECT_TRUE(shape.keep(operations, 100, 40));
  shape.padding(100, 2000);  // it may be longer than what there is room for
  shape.finish(bytes.data(), bytes.data());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto other = bytes;
    other[i] = std::byte{0xff};
    EXPECT_EQ(shape.is(somewhere, other), i >= 3 && i < 6) << i;
    EXPECT_TRUE(shape.is(somewhere, bytes));
  }
}

TEST(Shape, RefusesWhatIsTooMuch) {
  Shape shape;
  shape.begin(somewhere, 0, 0, 0);
  EXPECT_TRUE(shape.numbers(0, 0, 64, 4, true));
  EXPECT_FALSE(shape.numbers(0, 0, 65, 4, true));
  EXPECT_FALSE(shape.numbers(0, 0, SIZE_MAX, 8, true));
  EXPECT_TRUE(shape.numbers(1016, 1016, 1, 8, true));
  EXPECT_FALSE(shape.numbers(1017, 0, 1, 8, true));
  EXPECT_FALSE(shape.numbers(0, 1017, 1, 8, true));
  for (int i = 2; i < 64; ++i) {
    EXPECT_TRUE(shape.numbers(0, 0, 1, 1, true));
  }
  EXPECT_FALSE(shape.numbers(0, 0, 1, 1, true));
  EXPECT_TRUE(shape.keep(1, 1024, 1024));
  EXPECT_FALSE(shape.keep(2, 1025, 1024));
  EXPECT_FALSE(shape.keep(2, 1024, 1025));
  EXPECT_TRUE(shape.has_room_to(1024));
  EXPECT_FALSE(shape.has_room_to(1025));
}

TEST(Shape, KeepsNothingShortAndNothingOfFewOperations) {
  Shape shape;
  record_same(shape, counted(31));
  EXPECT_FALSE(shape.is(somewhere, counted(31)));
  shape.begin(somewhere, 7, 0, 0);
  EXPECT_TRUE(shape.keep(7 + operations - 1, 40, 40));
  shape.finish(counted(40).data(), counted(40).data());
  EXPECT_FALSE(shape.is(somewhere, counted(40)));
}

TEST(Shape, ForgetsWhatItWasWhenRecordingBegins) {
  Shape shape;
  record_same(shape, counted(40));
  shape.begin(somewhere, 0, 0, 0);
  EXPECT_FALSE(shape.is(somewhere, counted(40)));
}

// Recordings take time.
TEST(Shape, IsRecordedEverMoreSeldomWhereNothingRepeats) {
  Shape shape;
  const auto stretch = [](unsigned number) {
    auto bytes = counted(40);
    bytes[3] = static_cast<std::byte>(number);
    bytes[4] = static_cast<std::byte>(number >> 8U);
    return bytes;
  };
  std::vector<unsigned> recorded;
  unsigned number = 0;
  const auto convert = [&](const std::vector<std::byte>& bytes) {
    ++number;
    if (!shape.is(somewhere, bytes) && shape.is_due()) {
      recorded.push_back(number);
      record_same(shape, bytes);
    }
  };
  for (unsigned i = 1; i <= 5000; ++i) {
    convert(stretch(i));
  }
  EXPECT_EQ(recorded, (std::vector<unsigned>{2, 6, 14, 30, 62, 126, 254, 510, 1022, 2046, 3070, 4094}));
  // But in the end what repeats is noticed, and then one that differs now and then does no harm.
  for (unsigned i = 0; i < 1024; ++i) {
    convert(stretch(7));
  }
  EXPECT_TRUE(shape.is(somewhere, stretch(7)));
  recorded.clear();
  for (unsigned i = 0; i < 2000; ++i) {
    convert(stretch(i % 10 == 0 ? 8 : 7));
  }
  EXPECT_TRUE(recorded.empty());
  // By then it is as quick to learn as at first.
  number = 0;
  for (unsigned i = 0; i < 3; ++i) {
    convert(stretch(9));
  }
  EXPECT_EQ(recorded, std::vector<unsigned>{2});
}

// Shapes in conversions

TEST(Conversion, RemembersTheFrontOfACloud) {
  const auto plan = plan_of(builtin("sensor_msgs/PointCloud2"));
  // Header, height and width, one field, is_bigendian, steps; an array of one byte follows, and is_dense.
  const auto sample =
      hex("00010000 01000000 02000000 04000000 6d617000 01000000 05000000"
          "01000000 02000000 7800 0000 03000000 07 000000 01000000 00 000000 04000000 14000000"
          "01000000 5a 01");
  const std::size_t front = sample.size() - 10;  // and 4 bytes of encapsulation
  ConversionScratch scratch;
  for (unsigned i = 0; i < 2; ++i) {
    ASSERT_TRUE(plan.cdr_to_someip(sample, scratch));
  }
  const Shape::Conversion conversion{
      .program = plan.program().number, .to_cdr = false, .order = std::endian::little, .position = 0};
  Shape& shape = scratch.memory().shape(false, 0);
  EXPECT_TRUE(shape.is(conversion, ByteView{sample}.subspan(4)));
  EXPECT_EQ(shape.reads(), front);
  EXPECT_EQ(plan.program().ops[shape.end()].kind, Op::Kind::number_sequence);
  // The other direction has its own.
  const auto payload = hex(to_someip(plan, sample));
  for (unsigned i = 0; i < 2; ++i) {
    ASSERT_EQ(shown(plan.someip_to_cdr(payload, scratch)), to_hex(sample));
  }
  Shape& back = scratch.memory().shape(true, 0);
  EXPECT_TRUE(back.is({.program = plan.program().number, .to_cdr = true, .position = 4}, payload));
  EXPECT_EQ(back.reads(), payload.size() - 6);
  EXPECT_TRUE(shape.is(conversion, ByteView{sample}.subspan(4)));
}

TEST(Conversion, RemembersAnElementForTheNextOne) {
  const auto plan = plan_of(trees(
      {{"Marked", "int32 sec\nuint32 nanosec\nstring frame\nfloat64[7] pose\nuint32[] marks\nuint32 last"},
       {"All", "int32 front\nMarked[] poses"}}));
  const Op& poses = plan.program().ops[1];
  ASSERT_EQ(poses.kind, Op::Kind::sequence);
  // Stamp, frame, seven numbers, no marks, and one number more, with which each stands alike.
  const std::string pose =
      "01000000 02000000 04000000 6d617000" + std::string(2 * 56, '3') + "00000000 05000000";
  const auto sample = hex("00010000 07000000 02000000" + pose + pose);
  ConversionScratch scratch;
  ASSERT_TRUE(plan.cdr_to_someip(sample, scratch));
  Shape& shape = scratch.memory().shape(false, poses.slot);
  const Shape::Conversion conversion{
      .program = plan.program().number, .to_cdr = false, .order = std::endian::little, .position = 8};
  EXPECT_TRUE(shape.is(conversion, hex(pose)));
  EXPECT_EQ(shape.reads(), 80U);
}

// Neither to remember nor to take what is remembered; the first message makes room.
TEST(Conversion, AllocatesNothingForShapesInSteadyState) {
  const auto tree = builtin("diagnostic_msgs/DiagnosticArray");
  const auto plan = plan_of(tree);
  std::vector<std::vector<std::byte>> samples;
  std::vector<std::vector<std::byte>> payloads;
  for (const unsigned form : {3U, 3U, 3U, 4U, 5U, 5U, 5U, 3U}) {  // new ones, too
    const auto numbers = static_cast<unsigned>(samples.size());
    samples.push_back(RandomMessage{tree, std::endian::little, form, numbers}.bytes());
    payloads.push_back(hex(to_someip(plan, samples.back())));
  }
  ConversionScratch out;
  ConversionScratch back;
  const auto longest = std::ranges::max_element(samples, {}, &std::vector<std::byte>::size);
  ASSERT_TRUE(plan.cdr_to_someip(*longest, out));
  ASSERT_TRUE(plan.someip_to_cdr(hex(to_someip(plan, *longest)), back));
  const std::size_t before = allocations();
  for (unsigned turn = 0; turn < 40; ++turn) {
    ASSERT_TRUE(plan.cdr_to_someip(samples[turn / 5], out));
    ASSERT_TRUE(plan.someip_to_cdr(payloads[turn / 5], back));
  }
  EXPECT_EQ(allocations(), before);
  EXPECT_GT(out.memory().shape(false, 0).reads(), 0U);
  EXPECT_GT(out.memory().shape(false, 1).reads(), 0U);
}

// The same element behind an array that is now longer, now shorter: padding is elsewhere.
TEST(Conversion, RemembersElementsWithTheirPlace) {
  const auto tree =
      trees({{"Part", "uint8 a\nfloat64 b\nstring c\nuint16 d\nfloat64[2] e\nint32 f\nuint8[] g"},
             {"All", "uint8[] front\nPart[] parts"}});
  const auto plan = test::plan(tree, {});
  ConversionScratch out;
  ConversionScratch back;
  for (unsigned turn = 0; turn < 200; ++turn) {
    const std::size_t front = (turn / 3 + turn / 16 * (turn % 2)) % 9;
    std::vector<std::byte> payload = hex("000000" + std::string("0") + std::to_string(front));
    payload.resize(payload.size() + front, std::byte{0x5a});
    const auto part = hex("0000002d 01 0102030405060708 00000006 efbbbf616200 0304" + std::string(32, '3') +
                          "00000007 00000000");
    payload.insert(payload.end(), part.begin(), part.end());
    const auto cdr = to_cdr(plan, payload);
    ASSERT_EQ(shown(plan.someip_to_cdr(payload, back)), cdr) << front;
    const auto sample = hex(cdr);
    ASSERT_EQ(shown(plan.cdr_to_someip(sample, out)), to_hex(payload)) << front;
    ASSERT_EQ(to_hex(written_by_payload_writer(tree, sample, {})), to_hex(payload));
  }
  EXPECT_GT(out.memory().shape(false, 1).reads(), 0U);
  EXPECT_GT(back.memory().shape(true, 1).reads(), 0U);
}

/// What converts in the same way as many messages of a type.
struct Subject {
  std::string name;
  TypeTree tree;
  MessageRules rules;
};

MessageRules field_rules() {
  using someip::FieldWidth;
  MessageRules rules{someip::commonapi_rules};
  rules.types["test_msgs/msg/Part"].fields = {{"a", {.bits = 11}}, {"b", {.bits = 3}}, {"c", {.bits = 17}}};
  TypeRules& other = rules.types["test_msgs/msg/Part#other"];
  other.itself.struct_length = FieldWidth::bits16;
  other.fields = {{"f", {.string_length = FieldWidth::bits8, .bom = false}}};
  TypeRules& shape = rules.types["test_msgs/msg/Shape"];
  shape.form = TypeRules::Form::choice;
  shape.itself = {.union_length = FieldWidth::bits8,
                  .union_type = FieldWidth::bits16,
                  .union_length_first = false,
                  .selectors = {7, 1, 900}};
  shape.fields["part"].struct_length = FieldWidth::bits8;
  rules.types["test_msgs/msg/All"].fields = {
      {"text", {.string_length = FieldWidth::bits8}},
      {"numbers", {.array_length = FieldWidth::bits16}},
      {"parts", {.array_length = FieldWidth::bits16, .struct_length = FieldWidth::bits8}},
      {"few", {.bits = 5}},
      {"other", {.variant = "test_msgs/msg/Part#other"}},
      {"texts", {.encoding = someip::StringEncoding::utf16le, .terminator = false}},
      {"wide", {.string_length = FieldWidth::bits16, .encoding = someip::StringEncoding::utf16le}},
      {"last", {.array_length = FieldWidth::bits8}},
      {"data", {.array_length = FieldWidth::bits16}}};
  return rules;
}

std::vector<Subject> subjects() {
  std::vector<Subject> result;
  for (const char* const type :
       {"sensor_msgs/PointCloud2", "tf2_msgs/TFMessage", "nav_msgs/Path", "nav_msgs/Odometry",
        "sensor_msgs/JointState", "sensor_msgs/Image", "sensor_msgs/CameraInfo", "sensor_msgs/NavSatFix",
        "diagnostic_msgs/DiagnosticArray", "visualization_msgs/MarkerArray"}) {
    for (const char* const rules : {"", "autosar", "commonapi", "commonapi_little", "little", "short",
                                    "legacy_strings", "utf16le", "utf16be_plain", "aligned4", "aligned32"}) {
      result.push_back(
          {std::string{type} + " " + rules, builtin(type), *rules == '\0' ? PayloadRules{} : profile(rules)});
    }
  }
  const auto mixed = trees({{"Part", "uint8 a\nfloat64 b\nstring c\nbool d\nuint16[<=3] e"},
                            {"All",
                             "Part part\nuint8 a\nwstring wide\nbool[] flags\nPart[] parts\nPart[2] two\n"
                             "string<=5[<=3] bounded\nint64[<=3] few\nuint16 last"}});
  MessageRules mixed_orders;
  mixed_orders.types["test_msgs/msg/Part"].byte_orders = {{"b", std::endian::little}};
  result.push_back({"mixed", mixed, {}});
  result.push_back({"mixed, short", mixed, profile("short")});
  result.push_back({"mixed orders", mixed, mixed_orders});
  const auto special = trees(
      {{"Flags", "bool a\nbool[3] b"},
       {"Part", "uint8 kind 3\nstring name \"n\"\nuint32 added 7"},
       {"Shape", "uint8[<=1] dot\nPart[<=1] part\nuint32[<=1] wide\nFlags[<=1] flags"},
       {"Block", "uint16 a 1\nfloat64[<=2] b\nShape shape\nstring label"},
       {"All",
        "Block block\nFlags flags\nBlock[] blocks\nShape[2] shapes\nPart part\nint16[3] more [1, 2, 3]"}});
  MessageRules rules;
  rules.payload.struct_length = someip::FieldWidth::bits16;
  rules.types["test_msgs/msg/Flags"].form = TypeRules::Form::bits16;
  rules.types["test_msgs/msg/Shape"].form = TypeRules::Form::choice;
  rules.types["test_msgs/msg/Block"].fixed_strings["label"] = 32;
  result.push_back({"unions and bits", special, rules});
  rules.default_missing = true;
  result.push_back({"defaults", special, rules});
  rules.types["test_msgs/msg/Part"].tags = {
      {"kind", someip::DataId{1}}, {"name", someip::DataId{2}}, {"added", someip::DataId{3}}};
  rules.payload.smallest_tagged_length = true;
  result.push_back({"tags and defaults", special, rules});
  rules.default_missing = false;
  result.push_back({"tags", special, rules});
  const auto uses = trees(
      {{"Part", "uint16 a\nuint8 b\nint32 c\nbool d\nfloat32 e\nstring f"},
       {"Shape", "uint8[<=1] dot\nPart[<=1] part\nuint32[<=1] wide"},
       {"All",
        "Part part\nstring text\nuint16[] numbers\nPart[] parts\nShape[] shapes\nuint8[6] few\nuint64 long\n"
        "Part other\nstring[] texts\nwstring wide\nuint16[3] last\nuint8[] data"}});
  result.push_back({"rules of fields", uses, field_rules()});
  MessageRules missing = field_rules();
  missing.default_missing = true;
  result.push_back({"rules of fields and defaults", uses, missing});
  return result;
}

/// Something else than the same bytes: mostly not good.
std::vector<std::byte> spoilt(std::vector<std::byte> bytes, std::minstd_rand& random) {
  switch (random() % 4) {
    case 0:
      bytes.resize(bytes.size() - random() % bytes.size());
      break;
    case 1:
      bytes.resize(bytes.size() + 1 + random() % 8);
      break;
    default:
      bytes[random() % bytes.size()] ^= static_cast<std::byte>(1U << random() % 8U);
  }
  return bytes;
}

/// Bytes, or an error in words.
using Outcome = tl::expected<std::vector<std::byte>, std::string>;
Outcome outcome(const Converted& converted) {
  return converted ? Outcome{joined(*converted)} : tl::unexpected{to_string(converted.error())};
}

/// One scratch of each direction for many messages that are alike: with each of them it does as a new one, in
/// which nothing is remembered, as the operations alone, and as the libraries of both sides.
class ManyMessages {
 public:
  ManyMessages(const Subject& subject, const ConversionPlan& plan, const ConversionPlan& plain,
               std::endian order)
      : subject_{subject}, plan_{plan}, plain_{plain}, order_{order} {}

  void convert(std::minstd_rand& random) {
    const bool is_plain = subject_.rules.types.empty() && !has_wstring(subject_.tree);
    for (unsigned turn = 0; turn < 30; ++turn) {
      // Of one form for a while; now and then another one, or what is wrong.
      const unsigned form = 1 + turn / 15 + (random() % 8 == 0 ? 7 : 0);
      const auto numbers = static_cast<unsigned>(random());
      const auto sample = RandomMessage{subject_.tree, order_, form, numbers, subject_.rules}.bytes();
      const auto payload = there(sample);
      ASSERT_TRUE(payload) << payload.error();
      const auto cdr = back(*payload);
      ASSERT_TRUE(cdr) << cdr.error();
      if (is_plain && turn % 2 == 0) {
        ASSERT_EQ(*payload, written_by_payload_writer(subject_.tree, sample, subject_.rules.payload));
        ASSERT_EQ(*cdr, rewritten_by_fastcdr(subject_.tree, sample, std::endian::native));
      }
      there(spoilt(sample, random));
      if (!payload->empty()) {
        back(spoilt(*payload, random));
      }
      if (testing::Test::HasFailure()) {
        return;
      }
    }
  }

  /// How many shapes there are.
  [[nodiscard]] std::size_t shapes() {
    std::size_t found = 0;
    for (std::size_t slot = 0; slot < Memory::slots; ++slot) {
      found += (out_.memory().shape(false, slot).reads() > 0 ? 1U : 0U) +
               (back_.memory().shape(true, slot).reads() > 0 ? 1U : 0U);
    }
    return found;
  }

 private:
  Outcome there(const std::vector<std::byte>& sample) {
    ConversionScratch fresh;
    const auto result = outcome(plan_.cdr_to_someip(sample, out_));
    EXPECT_EQ(result, outcome(plan_.cdr_to_someip(sample, fresh)));
    EXPECT_EQ(result, outcome(plain_.cdr_to_someip(sample, fresh)));
    return result;
  }
  Outcome back(const std::vector<std::byte>& payload) {
    ConversionScratch fresh;
    const auto result = outcome(plan_.someip_to_cdr(payload, back_));
    EXPECT_EQ(result, outcome(plan_.someip_to_cdr(payload, fresh)));
    EXPECT_EQ(result, outcome(plain_.someip_to_cdr(payload, fresh)));
    return result;
  }

  const Subject& subject_;
  const ConversionPlan& plan_;
  const ConversionPlan& plain_;
  std::endian order_;
  ConversionScratch out_;
  ConversionScratch back_;
};

TEST(Conversion, DoesNotDependOnTheMessagesBefore) {
  std::minstd_rand random{42};
  std::size_t shapes = 0;
  for (const Subject& subject : subjects()) {
    SCOPED_TRACE(subject.name);
    for (const std::size_t reference_from : {std::size_t{8}, SIZE_MAX}) {
      const auto plan = ConversionPlan::compile(subject.tree, subject.rules, reference_from);
      ASSERT_TRUE(plan) << plan.error();
      const auto plain = ConversionPlan::compile(subject.tree, subject.rules, reference_from,
                                                 ConversionPlan::Execution::plain);
      for (const auto order : {std::endian::little, std::endian::big}) {
        ManyMessages messages{subject, *plan, *plain, order};
        messages.convert(random);
        if (testing::Test::HasFailure()) {
          return;
        }
        shapes += messages.shapes();
      }
    }
  }
  EXPECT_GT(shapes, 500U);
}

TEST(Conversion, RemembersOnlyWhatDependsOnItsBytesAlone) {
  const auto program = [](const TypeTree& tree, const MessageRules& rules = {}) {
    return plan(tree, rules).program();
  };
  const auto slots = [](const Program& of) {
    return std::ranges::count_if(of.ops, [](const Op& op) { return op.slot != 0; });
  };
  EXPECT_TRUE(program(builtin("sensor_msgs/PointCloud2")).quick.front);
  EXPECT_EQ(slots(program(builtin("diagnostic_msgs/DiagnosticArray"))), 1);
  EXPECT_EQ(slots(program(builtin("visualization_msgs/MarkerArray"))), 1);
  EXPECT_FALSE(program(builtin("std_msgs/String")).quick.front);
  EXPECT_EQ(slots(program(tree_of("string[] names"))), 0);
  PayloadRules padded;
  padded.alignment = 4;  // padding depends on where something stands in SOME/IP
  EXPECT_FALSE(program(builtin("sensor_msgs/PointCloud2"), padded).quick.front);
  EXPECT_EQ(slots(program(builtin("diagnostic_msgs/DiagnosticArray"), padded)), 0);
  MessageRules defaults;
  defaults.default_missing = true;  // what is missing depends on where the message ends
  EXPECT_FALSE(program(builtin("sensor_msgs/PointCloud2"), defaults).quick.front);
  MessageRules tags;  // members come in any order, and length fields are shortened afterwards
  tags.types["test_msgs/msg/Test"].tags = {
      {"a", someip::DataId{1}}, {"b", someip::DataId{2}}, {"c", someip::DataId{3}}};
  EXPECT_FALSE(program(tree_of("uint8 a\nstring b\nfloat64 c"), tags).quick.front);
  MessageRules structs;
  structs.payload.struct_length = someip::FieldWidth::bits32;
  const auto behind_length = program(builtin("sensor_msgs/PointCloud2"), structs);
  EXPECT_FALSE(behind_length.quick.front);
  EXPECT_EQ(behind_length.ops[0].slot, 1U);
}

}  // namespace
}  // namespace trestle::messages::shape_test
