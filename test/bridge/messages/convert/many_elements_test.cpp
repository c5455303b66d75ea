// Arrays of so many elements, each unlike the others, that they are converted many at a time.
#include <gmock/gmock.h>

#include "test/bridge/messages/convert/cdr_walk.hpp"
#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/convert/random_message.hpp"
#include "test/bridge/messages/convert/support.hpp"
#include "test/bridge/messages/convert/type_rules.hpp"
#include "test/covers.hpp"

namespace trestle::messages::many_elements_test {
namespace {

using namespace trestle::test;
using someip::PayloadRules;
using testing::HasSubstr;

constexpr std::size_t encapsulation = 4;

TypeTree pairs(const std::string& array) {
  const std::string all = array + "\nuint8 last";
  return trees({{"Pair", "uint16 id\nstring key\nstring value\nbool good"}, {"All", all.c_str()}});
}

/// Little-endian CDR of a `Pair[] pairs` and what follows.
class Pairs {
 public:
  void add(std::string_view key, std::string_view value) {
    align(2);
    bytes_.insert(bytes_.end(), {std::byte{0x34}, std::byte{0x12}});
    text(key);
    text(value);
    bytes_.push_back(std::byte{1});
    ++count_;
  }
  /// Where the next one begins.
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::vector<std::byte> sample() const {
    std::vector<std::byte> result = bytes_;
    result[encapsulation] = static_cast<std::byte>(count_);
    result.push_back(std::byte{0x55});
    return result;
  }

 private:
  void align(std::size_t width) {
    bytes_.resize((bytes_.size() - encapsulation + width - 1) / width * width + encapsulation);
  }
  void text(std::string_view text) {
    align(4);
    bytes_.push_back(static_cast<std::byte>(text.size() + 1));
    bytes_.resize(bytes_.size() + 3);
    for (const char c : text) {
      bytes_.push_back(static_cast<std::byte>(c));
    }
    bytes_.push_back(std::byte{0});
  }

  std::vector<std::byte> bytes_ = hex("00010000 00000000");
  unsigned count_ = 0;
};

// Some with texts that are too long to be quick, as both libraries do.
TEST(ManyElements, AreConvertedAsBothLibrariesDo) {
  std::minstd_rand random{7};
  for (const auto& tree : {builtin("tf2_msgs/TFMessage"), builtin("diagnostic_msgs/DiagnosticArray"),
                           builtin("nav_msgs/Path"), builtin("geometry_msgs/PoseArray"),
                           pairs("Pair[] pairs"), pairs("Pair[50] pairs"), pairs("Pair[<=40] pairs")}) {
    SCOPED_TRACE(tree.root().name);
    for (const char* const profile_name :
         {"autosar", "little", "commonapi", "legacy_strings", "aligned4", "utf16le"}) {
      const PayloadRules rules = profile(profile_name);
      const auto plan = plan_of(tree, rules);
      ConversionScratch out;
      ConversionScratch back;
      for (unsigned turn = 0; turn < 12; ++turn) {
        const auto order = turn % 2 == 0 ? std::endian::little : std::endian::big;
        const RandomSizes sizes{.elements = 20, .text = turn % 3 == 0 ? 100U : 20U};
        const auto sample =
            RandomMessage{tree,  order, static_cast<unsigned>(random()), static_cast<unsigned>(random()),
                          rules, sizes}
                .bytes();
        const auto payload = plan.cdr_to_someip(sample, out);
        ASSERT_TRUE(payload) << to_string(payload.error());
        const auto bytes = joined(*payload);
        ASSERT_EQ(to_hex(bytes), to_hex(written_by_payload_writer(tree, sample, rules)));
        ASSERT_EQ(shown(plan.someip_to_cdr(bytes, back)),
                  to_hex(rewritten_by_fastcdr(tree, sample, std::endian::native)));
      }
    }
  }
}

TEST(ManyElements, AreToldOneByOneWhereOneIsWrong) {
  for (const char* const array : {"Pair[] pairs", "Pair[30] pairs"}) {
    const bool is_fixed = std::string_view{array}.find("30") != std::string_view::npos;
    const auto plan = plan_of(pairs(array));
    for (unsigned wrong = 0; wrong < 30; ++wrong) {
      Pairs message;
      std::size_t begin = 0;
      std::size_t end = 0;
      for (unsigned i = 0; i < 30; ++i) {
        begin = i == wrong ? message.size() : begin;
        // Of 70 characters: more than is quick.
        message.add("key " + std::to_string(i * i), i == 20 ? std::string(70, 'x') : std::string(i, 'v'));
        end = i == wrong ? message.size() : end;
      }
      auto sample = message.sample();
      if (is_fixed) {  // has no count
        sample.erase(sample.begin() + encapsulation, sample.begin() + 2 * encapsulation);
        begin -= encapsulation;
        end -= encapsulation;
      }
      const std::string name = "pairs[" + std::to_string(wrong) + "]";
      const auto payload = hex(to_someip(plan, sample));
      ASSERT_EQ(to_cdr(plan, payload), to_hex(sample));

      auto bad = sample;
      bad[end - 2] = std::byte{'!'};  // its last terminator
      EXPECT_THAT(to_someip(plan, bad), HasSubstr(name + ".value")) << wrong;
      bad = sample;
      bad[end - 1] = std::byte{2};
      EXPECT_THAT(to_someip(plan, bad), HasSubstr(name + ".good")) << wrong;
      // Here it may be seen at once that so many have no room.
      bad.resize(end - 1);
      EXPECT_THAT(to_someip(plan, bad), HasSubstr(wrong < 15 ? "pairs" : name + ".good")) << wrong;
      bad.resize(begin + 1);
      EXPECT_THAT(to_someip(plan, bad), HasSubstr("pairs")) << wrong;

      // The same in SOME/IP: id, two texts behind their lengths, the boolean.
      std::size_t at = is_fixed ? 0 : 4;
      const auto text_at = [&](std::size_t from) {
        return from + 4 + std::to_integer<std::size_t>(payload[from + 3]);
      };
      for (unsigned i = 0; i < wrong; ++i) {
        at = text_at(text_at(at + 2)) + 1;
      }
      const std::size_t value = text_at(at + 2);
      bad = payload;
      bad[value + 4] ^= std::byte{1};  // the byte order mark
      EXPECT_THAT(to_cdr(plan, bad), HasSubstr(name + ".value")) << wrong;
      bad = payload;
      bad[value] = std::byte{0xff};  // the length
      EXPECT_THAT(to_cdr(plan, bad), HasSubstr(name + ".value")) << wrong;
      if (is_fixed) {
        bad = payload;
        bad.resize(value);
        EXPECT_THAT(to_cdr(plan, bad), HasSubstr(wrong < 15 ? "pairs" : name + ".value")) << wrong;
      } else {  // ends within the element
        bad = payload;
        const auto length = static_cast<std::uint16_t>(value - 4);
        bad[2] = static_cast<std::byte>(length >> 8U);
        bad[3] = static_cast<std::byte>(length);
        EXPECT_THAT(to_cdr(plan, bad), HasSubstr(name + ".value")) << wrong;
      }
    }
  }
}

TEST(ManyElements, AreAsManyAsTheBoundSays) {
  covers({"feat_req_someipcompat_1199"});
  Pairs message;
  for (unsigned i = 0; i < 31; ++i) {
    message.add("key " + std::to_string(i), std::string(i % 7, 'v'));
  }
  const auto payload = hex(to_someip(plan_of(pairs("Pair[] pairs")), message.sample()));
  const auto bounded = pairs("Pair[<=30] pairs");
  EXPECT_THAT(to_someip(plan_of(bounded), message.sample()), HasSubstr("pairs"));
  PayloadRules rules;
  rules.cut_longer_arrays = false;
  EXPECT_THAT(to_cdr(plan_of(bounded, rules), payload), HasSubstr("pairs"));
  Pairs cut;
  for (unsigned i = 0; i < 30; ++i) {
    cut.add("key " + std::to_string(i), std::string(i % 7, 'v'));
  }
  rules.cut_longer_arrays = true;
  EXPECT_EQ(to_cdr(plan_of(bounded, rules), payload), to_hex(cut.sample()));
  EXPECT_EQ(to_cdr(plan_of(pairs("Pair[<=31] pairs"), rules), payload), to_hex(message.sample()));
}

// To compare them with what is remembered takes longer.
TEST(ManyElements, HaveNoShapeWhereTheLoopDoesAllOfThem) {
  const auto array_of = [](const char* part) {
    return plan_of(trees({{"Part", part}, {"All", "Part[] parts"}})).program().ops[0];
  };
  const Op quick = array_of("uint16 id\nstring key\nfloat64[7] pose\nbool good");
  EXPECT_TRUE(quick.all_in_loop);
  EXPECT_EQ(quick.slot, 0);
  for (const char* const more : {"uint8[] more", "float64[36] more", "wstring more", "bool[65] more"}) {
    const Op op = array_of((std::string{"uint16 id\nstring key\nbool good\n"} + more).c_str());
    EXPECT_FALSE(op.all_in_loop) << more;
    EXPECT_NE(op.slot, 0) << more;
  }
}

}  // namespace
}  // namespace trestle::messages::many_elements_test
