#include "bridge/messages/convert/quick/message_shape.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "test/bridge/messages/convert/cdr_walk.hpp"
#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/convert/type_rules.hpp"

namespace trestle::messages::message_shape_test {
namespace {

using namespace trestle::test;
using someip::PayloadRules;

/// Bytes of an array.
constexpr std::size_t reference_from = 64;

/// What varies from message to message.
struct Values {
  std::uint32_t nanosec = 0;
  std::uint32_t width = 0;
  std::string frame = "lidar_top_left";
  std::size_t bytes = reference_from;
  bool is_dense = true;
  std::byte padding{0};
};

/// Writes CDR.
class Cdr {
 public:
  explicit Cdr(std::endian order, std::byte padding = {}) : order_{order}, padding_{padding} {
    bytes_ = {std::byte{0}, static_cast<std::byte>(order == std::endian::little), std::byte{0}, std::byte{0}};
  }

  Cdr& byte(unsigned value) {
    bytes_.push_back(static_cast<std::byte>(value));
    return *this;
  }
  Cdr& number(std::uint64_t value, std::size_t width = 4) {
    bytes_.resize((bytes_.size() - 4 + width - 1) / width * width + 4, padding_);
    for (std::size_t i = 0; i < width; ++i) {
      byte(static_cast<unsigned>(value >> 8 * (order_ == std::endian::little ? i : width - 1 - i)));
    }
    return *this;
  }
  Cdr& string(std::string_view text) {
    number(text.size() + 1);
    for (const char character : text) {
      byte(static_cast<unsigned char>(character));
    }
    return byte(0);
  }
  Cdr& header(const Values& values) { return number(1700000000).number(values.nanosec).string(values.frame); }
  Cdr& array(std::size_t size) {
    number(size);
    for (std::size_t i = 0; i < size; ++i) {
      byte(static_cast<unsigned>(i % 251));
    }
    return *this;
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::endian order_;
  std::byte padding_;
  std::vector<std::byte> bytes_;
};

std::vector<std::byte> cloud(std::endian order, const Values& values) {
  Cdr cdr{order, values.padding};
  cdr.header(values).number(1).number(values.width).number(3);
  for (unsigned i = 0; i < 3; ++i) {
    cdr.string(std::string(1, static_cast<char>('x' + i))).number(4 * i).byte(7).number(1);
  }
  cdr.byte(0).number(12).number(12 * values.width).array(values.bytes);
  return cdr.byte(values.is_dense ? 1 : 0).bytes();
}

/// A type and its messages.
struct Kind {
  std::string name;
  TypeTree tree;
  std::vector<std::byte> (*message)(std::endian order, const Values& values);
};

std::vector<Kind> kinds() {
  return {
      {"PointCloud2", builtin("sensor_msgs/PointCloud2"), cloud},
      {"CompressedImage", builtin("sensor_msgs/CompressedImage"),
       [](std::endian order, const Values& values) {
         return Cdr{order, values.padding}.header(values).string("jpeg").array(values.bytes).bytes();
       }},
      {"Image", builtin("sensor_msgs/Image"),
       [](std::endian order, const Values& values) {
         return Cdr{order, values.padding}
             .header(values)
             .number(7)
             .number(values.width)
             .string("rgb8")
             .byte(1)
             .number(3 * values.width)
             .array(values.bytes)
             .bytes();
       }},
      {"numbers of each size in front, bytes behind",
       tree_of("uint8 a\nuint16 b\nuint64 c\nint8[3] d\nstring e\nuint32 f\nuint8[<=200] data\n"
               "bool g\nuint8 h\nbool i"),
       [](std::endian order, const Values& values) {
         return Cdr{order, values.padding}
             .byte(values.nanosec % 256)
             .number(values.nanosec % 65536, 2)
             .number(std::uint64_t{values.nanosec} << 17U, 8)
             .byte(1)
             .byte(values.width % 3)
             .byte(3)
             .string(values.frame)
             .number(values.width)
             .array(values.bytes)
             .byte(1)
             .byte(7)
             .byte(values.is_dense ? 1 : 0)
             .bytes();
       }},
      {"now and then many numbers", tree_of("uint32 a\nuint32[12] b\nstring c\nuint16[12] d\nuint8[] data"),
       [](std::endian order, const Values& values) {
         Cdr cdr{order, values.padding};
         cdr.number(values.nanosec);
         const std::uint32_t first = values.is_dense ? 5 : values.nanosec;
         for (unsigned i = 0; i < 12; ++i) {
           cdr.number(first + i);
         }
         cdr.string(values.frame);
         for (unsigned i = 0; i < 12; ++i) {
           cdr.number((first + i) % 65536, 2);
         }
         return cdr.array(values.bytes).bytes();
       }},
      {"too little in front", tree_of("uint8 a\nbool b\nuint8 c\nuint8[] data"),
       [](std::endian order, const Values& values) {
         return Cdr{order, values.padding}
             .byte(values.nanosec % 256)
             .byte(values.is_dense ? 1 : 0)
             .byte(values.width % 256)
             .array(values.bytes)
             .bytes();
       }},
      {"much behind", tree_of("uint8 a\nuint16 b\nstring c\nuint32 d\nstring e\nuint8[] data\nstring f"),
       [](std::endian order, const Values& values) {
         return Cdr{order, values.padding}
             .byte(1)
             .number(values.nanosec % 65536, 2)
             .string(values.frame)
             .number(values.width)
             .string("something that is long enough")
             .array(values.bytes)
             .string("more than is remembered")
             .bytes();
       }}};
}

using Outcome = tl::expected<std::vector<std::byte>, std::string>;
Outcome outcome(const Converted& converted) {
  return converted ? Outcome{joined(*converted)} : tl::unexpected{to_string(converted.error())};
}

/// A plan, and a scratch of each direction that remembers.
class Both {
 public:
  Both(const TypeTree& tree, std::endian order, const PayloadRules& rules, std::size_t least)
      : plan_{plan_of(tree, rules, least)},
        plain_{plan_of(tree, rules, least, ConversionPlan::Execution::plain)},
        order_{order} {}

  /// With what is remembered, and how it is without.
  Outcome to_someip(ByteView sample) {
    const std::vector<std::byte> exact{sample.begin(), sample.end()};
    Gathered result;
    is_known_ =
        sample.size() > 4 && sample[0] == std::byte{0} && sample[1] <= std::byte{1} &&
        out_.memory().convert({.program = plan_.program().number,
                               .order = sample[1] == std::byte{0} ? std::endian::big : std::endian::little},
                              ByteView{exact}.subspan(4), result);
    ConversionScratch fresh;
    auto made = outcome(plan_.cdr_to_someip(exact, out_));
    EXPECT_EQ(made, outcome(plan_.cdr_to_someip(exact, fresh)));
    EXPECT_EQ(made, outcome(plain_.cdr_to_someip(exact, fresh)));
    if (is_known_) {
      EXPECT_EQ(made, joined(result));
    }
    return made;
  }
  Outcome to_cdr(ByteView payload) {
    const std::vector<std::byte> exact{payload.begin(), payload.end()};
    Gathered result;
    is_known_ = back_.memory().convert({.program = plan_.program().number, .to_cdr = true, .position = 4},
                                       exact, result);
    ConversionScratch fresh;
    auto made = outcome(plan_.someip_to_cdr(exact, back_));
    EXPECT_EQ(made, outcome(plan_.someip_to_cdr(exact, fresh)));
    EXPECT_EQ(made, outcome(plain_.someip_to_cdr(exact, fresh)));
    if (is_known_) {
      EXPECT_EQ(made, joined(result));
    }
    return made;
  }
  /// Whether the last one was.
  [[nodiscard]] bool is_known() const { return is_known_; }
  [[nodiscard]] std::endian order() const { return order_; }

 private:
  ConversionPlan plan_;
  ConversionPlan plain_;
  std::endian order_;
  ConversionScratch out_;
  ConversionScratch back_;
  bool is_known_ = false;
};

Both both(const TypeTree& tree, std::endian order = std::endian::little, const PayloadRules& rules = {}) {
  return {tree, order, rules, reference_from};
}

TEST(MessageShape, IsTakenForMessagesThatDifferInNumbersAndInTheirArray) {
  for (const Kind& kind : kinds()) {
    for (const char* const rules : {"", "commonapi", "commonapi_little", "utf16le"}) {
      for (const auto order : {std::endian::little, std::endian::big}) {
        SCOPED_TRACE(kind.name + " " + rules + (order == std::endian::big ? " big" : ""));
        const PayloadRules payload_rules = *rules == '\0' ? PayloadRules{} : profile(rules);
        Both conversion = both(kind.tree, order, payload_rules);
        unsigned known_there = 0;
        unsigned known_back = 0;
        for (unsigned i = 0; i < 12; ++i) {
          // The places of what is behind count, too.
          const auto sample =
              kind.message(order, {.nanosec = 0x01020304 * i, .width = 1 + i % 5, .bytes = 64 + 8 * (i % 5)});
          const auto payload = conversion.to_someip(sample);
          ASSERT_EQ(payload, written_by_payload_writer(kind.tree, sample, payload_rules));
          known_there += conversion.is_known() ? 1 : 0;
          ASSERT_EQ(conversion.to_cdr(*payload),
                    rewritten_by_fastcdr(kind.tree, sample, std::endian::native));
          known_back += conversion.is_known() ? 1 : 0;
        }
        // Once all numbers have differed that do.
        const bool is_left = kind.name == "much behind" || kind.name == "too little in front";
        EXPECT_EQ(known_there >= 8, !is_left) << known_there;
        EXPECT_EQ(known_back, known_there);
      }
    }
  }
}

// As of clouds whose points are 22 bytes, and never as many.
TEST(MessageShape, IsTakenForAnyLengthOfTheArray) {
  const auto known = [](const Kind& kind) {
    Both conversion = both(kind.tree);
    unsigned there = 0;
    unsigned back = 0;
    for (unsigned i = 0; i < 24; ++i) {
      const auto sample =
          kind.message(std::endian::little, {.nanosec = i, .width = 1 + i, .bytes = 64 + 11 * i % 24});
      const auto payload = conversion.to_someip(sample);
      there += conversion.is_known() ? 1 : 0;
      EXPECT_EQ(payload, written_by_payload_writer(kind.tree, sample, {}));
      EXPECT_EQ(conversion.to_cdr(*payload), rewritten_by_fastcdr(kind.tree, sample, std::endian::native));
      back += conversion.is_known() ? 1 : 0;
    }
    return std::pair{there, back};
  };
  EXPECT_EQ(known(kinds()[0]), (std::pair{22U, 22U}));  // PointCloud2: is_dense
  EXPECT_EQ(known(kinds()[1]), (std::pair{22U, 22U}));  // CompressedImage: nothing
}

// Whatever comes, in whatever order: the same as by the operations.
TEST(MessageShape, ChangesNothingOfWhatBecomesOfMessages) {
  std::minstd_rand random{7};
  unsigned known = 0;
  for (const Kind& kind : kinds()) {
    for (const char* const rules : {"", "autosar", "commonapi", "commonapi_little", "short", "aligned4"}) {
      for (const auto order : {std::endian::little, std::endian::big}) {
        SCOPED_TRACE(kind.name + " " + rules + (order == std::endian::big ? " big" : ""));
        Both conversion = both(kind.tree, order, *rules == '\0' ? PayloadRules{} : profile(rules));
        for (unsigned i = 0; i < 300; ++i) {
          Values values{.nanosec = static_cast<std::uint32_t>(random()),
                        .width = static_cast<std::uint32_t>(random() % 4)};
          values.bytes = random() % 3 == 0 ? random() % 240 : 96;
          values.frame = i / 40 % 2 == 0 ? "lidar_top_left" : "radar_left";
          values.frame.resize(i / 80 == 2 ? 70 : values.frame.size(), '_');  // is referenced itself
          values.is_dense = random() % 8 != 0;
          values.padding = static_cast<std::byte>(random() % 8 == 0 ? random() : 0);
          auto sample = kind.message(random() % 16 == 0 ? std::endian::big : order, values);
          const auto payload = conversion.to_someip(sample);
          known += conversion.is_known() ? 1 : 0;
          if (payload) {
            auto bytes = *payload;
            static_cast<void>(conversion.to_cdr(bytes));
            known += conversion.is_known() ? 1 : 0;
            bytes.resize(bytes.size() - std::min<std::size_t>(bytes.size(), random() % 4));
            static_cast<void>(conversion.to_cdr(bytes));
            bytes.resize(bytes.size() + random() % 9);
            static_cast<void>(conversion.to_cdr(bytes));
          }
          sample.resize(sample.size() + random() % 10 - 3);
          static_cast<void>(conversion.to_someip(sample));
          if (testing::Test::HasFailure()) {
            return;
          }
        }
      }
    }
  }
  EXPECT_GT(known, 5000U);
}

TEST(MessageShape, SeesEachBitThatIsAnotherOne) {
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    Both conversion = both(kind.tree);
    const auto sample = kind.message(std::endian::little, {.nanosec = 5});
    const auto other = kind.message(std::endian::little, {.nanosec = 6});
    const auto again = [&] {
      for (unsigned i = 0; i < 3; ++i) {
        const auto payload = conversion.to_someip(i % 2 == 0 ? other : sample);
        ASSERT_TRUE(payload);
        ASSERT_TRUE(conversion.to_cdr(*payload));
      }
    };
    again();
    const auto payload = *conversion.to_someip(sample);
    for (std::size_t i = 0; i < sample.size() + payload.size(); ++i) {
      for (const unsigned bit : {0U, 7U}) {
        auto spoilt = i < sample.size() ? sample : payload;
        spoilt[i < sample.size() ? i : i - sample.size()] ^= static_cast<std::byte>(1U << bit);
        static_cast<void>(i < sample.size() ? conversion.to_someip(spoilt) : conversion.to_cdr(spoilt));
        ASSERT_FALSE(testing::Test::HasFailure()) << i << ", bit " << bit;
        again();
      }
    }
  }
}

TEST(MessageShape, LeavesArraysThatAreTooLong) {
  const Kind bounded = kinds()[3];
  Both conversion = both(bounded.tree);
  const auto convert = [&](std::size_t bytes) {
    static std::uint32_t number = 0;
    return conversion.to_someip(bounded.message(std::endian::little, {.nanosec = ++number, .bytes = bytes}));
  };
  for (unsigned i = 0; i < 4; ++i) {
    ASSERT_TRUE(convert(80));
  }
  EXPECT_TRUE(conversion.is_known());
  ASSERT_TRUE(convert(200));
  EXPECT_TRUE(conversion.is_known());
  const auto too_long = convert(204);
  EXPECT_FALSE(conversion.is_known());
  ASSERT_FALSE(too_long);
  EXPECT_EQ(too_long.error().find("bound_exceeded"), 0U) << too_long.error();
}

TEST(MessageShape, LeavesEmptyArrays) {
  const Kind image = kinds()[1];
  Both conversion = both(image.tree);
  const auto is_known = [&](std::size_t bytes) {
    EXPECT_TRUE(conversion.to_someip(image.message(std::endian::little, {.bytes = bytes})));
    return conversion.is_known();
  };
  for (unsigned i = 0; i < 4; ++i) {
    static_cast<void>(is_known(64));
  }
  EXPECT_TRUE(is_known(1));
  EXPECT_FALSE(is_known(0));
  EXPECT_TRUE(is_known(64));
}

// Whichever of them are referenced.
TEST(MessageShape, ChangesNothingOfMessagesWithASecondArray) {
  unsigned known = 0;
  for (const char* const second : {"uint8[12] second", "uint8[] second"}) {
    const TypeTree tree =
        tree_of(std::string{"uint32 a\nstring b\nuint32[6] c\nstring d\nuint8[] data\n"} + second);
    for (const std::size_t bytes : {8U, 10U, 12U, 40U}) {
      for (const std::size_t least : {8U, 11U, 12U, 13U, 64U}) {
        SCOPED_TRACE(fmt::format("{}, {} bytes, {}", second, bytes, least));
        Both conversion{tree, std::endian::little, {}, least};
        for (unsigned i = 0; i < 16; ++i) {
          Cdr cdr{std::endian::little};
          cdr.number(i).string("text");
          for (unsigned k = 0; k < 6; ++k) {
            cdr.number(k);
          }
          cdr.string("b").array(bytes);
          if (std::string_view{second}.find("[]") != std::string_view::npos) {
            cdr.number(12);
          }
          for (unsigned k = 0; k < 12; ++k) {
            cdr.byte(k);
          }
          const auto payload = conversion.to_someip(cdr.bytes());
          ASSERT_EQ(payload, written_by_payload_writer(tree, cdr.bytes(), {}));
          ASSERT_EQ(conversion.to_cdr(*payload),
                    rewritten_by_fastcdr(tree, cdr.bytes(), std::endian::native));
          known += conversion.is_known() ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(known, 100U);
}

// As the operations do: so that one piece is sent, or written.
TEST(MessageShape, CopiesArraysThatAreTooSmallToBeReferenced) {
  for (const Kind& kind : {kinds()[0], kinds()[1], kinds()[3]}) {
    SCOPED_TRACE(kind.name);
    for (const std::size_t least : {reference_from, SIZE_MAX}) {
      const auto plan = plan_of(kind.tree, {}, least);
      ConversionScratch out;
      ConversionScratch back;
      for (unsigned i = 0; i < 8; ++i) {
        const std::size_t bytes = i % 2 == 0 ? 64 : 56;
        const auto sample = kind.message(std::endian::little, {.nanosec = i, .bytes = bytes});
        const auto payload = plan.cdr_to_someip(sample, out);
        ASSERT_TRUE(payload);
        EXPECT_EQ(joined(*payload), written_by_payload_writer(kind.tree, sample, {}));
        EXPECT_EQ(payload->slices.size() == 1, bytes < least) << bytes << " bytes of at least " << least;
        const auto exact = joined(*payload);
        const auto cdr = plan.someip_to_cdr(exact, back);
        ASSERT_TRUE(cdr);
        EXPECT_EQ(joined(*cdr), rewritten_by_fastcdr(kind.tree, sample, std::endian::native));
        EXPECT_EQ(cdr->slices.size() == 1, bytes < least) << bytes << " bytes of at least " << least;
      }
      Gathered result;
      const auto sample = kind.message(std::endian::little, {.nanosec = 9});
      EXPECT_TRUE(out.memory().convert({.program = plan.program().number, .order = std::endian::little},
                                       ByteView{sample}.subspan(4), result));
    }
  }
}

TEST(MessageShape, DoesNotLookAtPadding) {
  Both conversion = both(builtin("sensor_msgs/PointCloud2"));
  for (unsigned i = 0; i < 6; ++i) {
    const auto sample = cloud(std::endian::little, {.nanosec = i, .padding = static_cast<std::byte>(i)});
    EXPECT_EQ(conversion.to_someip(sample),
              written_by_payload_writer(builtin("sensor_msgs/PointCloud2"), sample, {}));
    EXPECT_EQ(conversion.is_known(), i >= 2);
  }
}

TEST(MessageShape, MovesWithTheScratch) {
  const auto plan = plan_of(builtin("sensor_msgs/PointCloud2"), {}, reference_from);
  ConversionScratch scratch;
  const auto sample = cloud(std::endian::little, {});
  for (unsigned i = 0; i < 3; ++i) {
    ASSERT_TRUE(plan.cdr_to_someip(sample, scratch));
  }
  const quick::Shape::Conversion conversion{.program = plan.program().number, .order = std::endian::little};
  Gathered result;
  ASSERT_TRUE(scratch.memory().convert(conversion, ByteView{sample}.subspan(4), result));
  ConversionScratch moved{std::move(scratch)};
  EXPECT_FALSE(
      scratch.memory().convert(conversion, ByteView{sample}.subspan(4), result));  // NOLINT(*-use-after-move)
  EXPECT_TRUE(moved.memory().convert(conversion, ByteView{sample}.subspan(4), result));
  const auto again = plan.cdr_to_someip(sample, moved);
  ASSERT_TRUE(again);
  EXPECT_EQ(to_hex(joined(*again)), to_someip(plan, sample));
}

TEST(MessageShape, IsOfOneProgramAndByteOrder) {
  const Kind kind = kinds()[2];
  const auto big = plan_of(kind.tree, {}, reference_from);
  const auto little = plan_of(kind.tree, profile("commonapi_little"), reference_from);
  ConversionScratch out;
  ConversionScratch back;
  const auto convert = [&](const ConversionPlan& plan, std::endian order, std::uint32_t number) {
    const auto sample = kind.message(order, {.nanosec = number});
    const auto payload = outcome(plan.cdr_to_someip(sample, out));
    ConversionScratch fresh;
    ASSERT_EQ(payload, outcome(plan.cdr_to_someip(sample, fresh)));
    const auto cdr = outcome(plan.someip_to_cdr(*payload, back));
    ASSERT_EQ(cdr, outcome(plan.someip_to_cdr(*payload, fresh)));
  };
  // Each for as long as it takes to be remembered, then alternately.
  for (std::uint32_t i = 0; i < 60; ++i) {
    const std::uint32_t turn = i < 40 ? i / 5 : i;
    convert(turn % 2 == 0 ? big : little, turn / 2 % 2 == 0 ? std::endian::little : std::endian::big, i);
    ASSERT_FALSE(testing::Test::HasFailure()) << i;
  }
}

// What a message becomes may depend on more than the bytes in front of the array and behind it.
TEST(MessageShape, IsOnlyOfMessagesWhoseBytesSayAll) {
  const auto array_at = [](const TypeTree& tree, const MessageRules& rules) {
    return ConversionPlan::compile(tree, rules)->program().quick.array_at;
  };
  const auto with = [](const char* name) {
    MessageRules rules;
    rules.payload = profile(name);
    return rules;
  };
  const TypeTree cloud = builtin("sensor_msgs/PointCloud2");
  EXPECT_NE(array_at(cloud, {}), 0U);
  EXPECT_NE(array_at(cloud, with("commonapi")), 0U);
  EXPECT_EQ(array_at(cloud, with("autosar")), 0U);   // the length of all comes first
  EXPECT_EQ(array_at(cloud, with("aligned4")), 0U);  // padding depends on the place in SOME/IP
  EXPECT_EQ(array_at(cloud, with("short")), 0U);     // the length field is smaller
  MessageRules defaults;
  defaults.default_missing = true;  // depends on where the message ends
  EXPECT_EQ(array_at(cloud, defaults), 0U);
  EXPECT_EQ(array_at(builtin("sensor_msgs/LaserScan"), {}), 0U);  // numbers that are swapped
  EXPECT_EQ(array_at(builtin("std_msgs/String"), {}), 0U);
  const std::string front = "uint64 a\nstring b\nstring c\nuint8[] data\n";
  EXPECT_NE(array_at(tree_of(front + "bool d\nuint8[2] e"), {}), 0U);
  EXPECT_EQ(array_at(tree_of(front + "bool d\nuint16 e"), {}), 0U);  // stands elsewhere behind another array
  EXPECT_EQ(array_at(tree_of(front + "string d"), {}), 0U);
}

}  // namespace
}  // namespace trestle::messages::message_shape_test
