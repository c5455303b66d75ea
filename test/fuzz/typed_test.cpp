#include "fuzz/mutate/typed.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "fuzz/mutate/generate.hpp"
#include "fuzz/mutate/value_tree.hpp"

namespace trestle::fuzz::typed_test {
namespace {

using Kind = Shape::Kind;
constexpr std::size_t max_size = 4'000;

Shape number(std::uint8_t bytes) {
  return {.kind = Kind::number, .bytes = bytes};
}
Shape text() {
  return {.kind = Kind::text, .length = 4, .bom = true, .terminator = true};
}
Shape of(std::vector<Shape> members) {
  return {.parts = std::move(members)};
}
Shape choice() {
  return {.kind = Kind::choice, .length = 4, .selectors = {1, 2}, .parts = {number(1), text()}};
}

Bytes bytes_of(std::initializer_list<int> numbers) {
  Bytes bytes;
  std::ranges::transform(numbers, std::back_inserter(bytes),
                         [](int one) { return static_cast<std::byte>(one); });
  return bytes;
}

/// What is written of the values that are read.
Bytes again(const Bytes& payload, const Shape& shape) {
  const auto values = read_values(payload, shape);
  return values ? write_values(*values) : Bytes{};
}

TEST(ValueTree, WritesWhatItReads) {
  const Shape all =
      of({number(2), text(), {.kind = Kind::list, .length = 1, .parts = {number(2)}}, choice()});
  const Bytes payload = bytes_of({0x12, 0x34,                                    // number
                                  0,    0,    0, 5, 0xef, 0xbb, 0xbf, 'a', 0,    // text
                                  4,    0,    1, 0, 2,                           // list
                                  0,    0,    0, 1, 0,    0,    0,    1,   7});  // choice
  const auto values = read_values(payload, all);
  ASSERT_TRUE(values);
  EXPECT_EQ(values->parts[0].number, 0x1234U);
  EXPECT_EQ(values->parts[1].text, bytes_of({'a'}));
  EXPECT_EQ(values->parts[2].parts[1].number, 2U);
  EXPECT_EQ(values->parts[3].parts[0].number, 7U);
  EXPECT_EQ(write_values(*values), payload);
}

TEST(ValueTree, KnowsNumbersOfFewBitsInBothOrders) {
  const Shape big = of({{.kind = Kind::number, .bytes = 1, .bits = 3},
                        {.kind = Kind::number, .bytes = 2, .bits = 13},
                        number(1)});
  const Bytes payload = bytes_of({0xad, 0x5c, 9});
  const auto values = read_values(payload, big);
  ASSERT_TRUE(values);
  EXPECT_EQ(values->parts[0].number, 5U);
  // The five bits that are left over of 13 come first, then a whole byte.
  EXPECT_EQ(values->parts[1].number, 0x155cU);
  EXPECT_EQ(again(payload, big), payload);
  Shape little = big;
  little.parts[1].order = std::endian::little;
  EXPECT_EQ(read_values(payload, little)->parts[1].number, 0x0b95U);
  EXPECT_EQ(again(payload, little), payload);
}

TEST(ValueTree, KnowsTagsInAnyOrderAndPadding) {
  Shape first = number(2);
  first.tag = 0x1001;
  Shape second = text();
  second.tag = 0x4002;
  second.optional = true;
  const Shape tagged = of({first, second});
  const Bytes payload = bytes_of({0x40, 0x02, 0, 0, 0, 4, 0xef, 0xbb, 0xbf, 0, 0x10, 0x01, 0xab, 0xcd});
  ASSERT_TRUE(has_shape(payload, tagged));
  EXPECT_EQ(again(payload, tagged), payload);
  // A member that nobody knows is left out.
  EXPECT_EQ(again(bytes_of({0x00, 0x09, 1, 0x10, 0x01, 0xab, 0xcd}), tagged),
            bytes_of({0x10, 0x01, 0xab, 0xcd}));

  Shape padded = text();
  padded.alignment = 4;
  const Shape aligned = of({padded, number(1)});
  const Bytes with_padding = bytes_of({0, 0, 0, 5, 0xef, 0xbb, 0xbf, 'x', 0, 0, 0, 0, 1});
  EXPECT_EQ(again(with_padding, aligned), with_padding);
}

TEST(ValueTree, KnowsTextsOfAFixedSizeAndInUtf16) {
  Shape fixed = text();
  fixed.length = 0;
  fixed.fixed_bytes = 6;
  const Shape six = of({fixed});
  const Bytes payload = bytes_of({0xef, 0xbb, 0xbf, 'a', 0, 0});
  EXPECT_EQ(read_values(payload, six)->parts[0].text, bytes_of({'a'}));
  EXPECT_EQ(again(payload, six), payload);
  Shape wide = text();
  wide.encoding = Shape::Encoding::utf16le;
  EXPECT_EQ(read_values(bytes_of({0, 0, 0, 6, 0xff, 0xfe, 'a', 0, 0, 0}), of({wide}))->parts[0].text,
            bytes_of({'a', 0}));
}

TEST(ValueTree, RefusesWhatIsNotOfTheShape) {
  EXPECT_FALSE(has_shape(bytes_of({1}), of({number(2)})));
  EXPECT_FALSE(has_shape(bytes_of({1, 2, 3}), of({number(2)})));
  EXPECT_FALSE(has_shape(bytes_of({0, 0, 0, 9, 1}), of({text()})));
  // Elements without bytes would be without end.
  EXPECT_FALSE(
      has_shape(bytes_of({0, 0, 0, 1, 1}), of({{.kind = Kind::list, .length = 4, .parts = {of({})}}})));
}

TEST(MakePayload, MakesMostlyPayloadsOfTheShapeAndEdgesOfValues) {
  Shape on_off = number(1);
  on_off.known = {0, 1};
  const Shape all =
      of({on_off, text(), choice(), {.kind = Kind::list, .length = 4, .most = 5, .parts = {number(4)}}});
  Random random{1};
  std::size_t whole = 0;
  std::size_t beyond = 0;
  std::set<std::size_t> sizes;
  for (int count = 0; count < 2'000; ++count) {
    const Bytes payload = make_payload(all, max_size, random);
    whole += has_shape(payload, all) ? 1U : 0U;
    beyond += payload.at(0) > std::byte{1} ? 1U : 0U;
    if (const auto values = read_values(payload, all)) {
      sizes.insert(values->parts[3].parts.size());
    }
  }
  EXPECT_GT(whole, 1'950U);
  EXPECT_GT(beyond, 0U);
  EXPECT_LT(beyond, 200U);
  EXPECT_THAT(sizes, testing::IsSupersetOf({0U, 1U, 5U, 6U}));  // with one more than there may be
}

TEST(MutatePayload, ReachesEachKindOfFlaw) {
  Shape tagged = number(1);
  tagged.tag = 0x0001;
  Shape maybe = text();
  maybe.tag = 0x4002;
  maybe.optional = true;
  const Shape all = of({text(), choice(), of({tagged, maybe})});
  Random random{2};
  std::set<Flaw> text_flaws;
  std::size_t lengths = 0;
  std::size_t selectors = 0;
  std::size_t missing = 0;
  for (int count = 0; count < 4'000; ++count) {
    Bytes payload = make_payload(all, max_size, random);
    mutate_payload(payload, all, max_size, random);
    EXPECT_LE(payload.size(), max_size);
    const auto values = read_values(payload, all);
    if (!values) {
      ++lengths;
      continue;
    }
    text_flaws.insert(values->parts[0].flaw);
    selectors += values->parts[1].flaw == Flaw::selector ? 1U : 0U;
    missing += values->parts.size() > 2 && values->parts[2].parts.size() < 2 ? 1U : 0U;
  }
  EXPECT_THAT(text_flaws, testing::IsSupersetOf({Flaw::none, Flaw::no_bom, Flaw::no_terminator}));
  EXPECT_GT(lengths, 100U);
  EXPECT_GT(selectors, 20U);
  EXPECT_GT(missing, 100U);
}

TEST(MakeSpoiltPayloads, HasEachThingThatCanBeWrongOnce) {
  Random random{1};
  const auto of_text = make_spoilt_payloads(of({number(1), text()}), max_size, random);
  ASSERT_EQ(of_text.size(), 7U);
  const Bytes right = bytes_of({0xef, 0xbb, 0xbf});
  const auto begins = [&](const Bytes& one) {
    return std::equal(right.begin(), right.end(), one.begin() + 5);
  };
  // Four lengths; then without BOM, without terminator, without both.
  EXPECT_TRUE(std::ranges::all_of(of_text.begin() + 1, of_text.begin() + 4,
                                  [&](const Bytes& one) { return one.size() == of_text[0].size(); }));
  EXPECT_FALSE(begins(of_text[4]));
  EXPECT_TRUE(begins(of_text[5]));
  EXPECT_NE(of_text[5].back(), std::byte{});
  EXPECT_EQ(std::to_integer<std::size_t>(of_text[5][4]), of_text[5].size() - 5);
  EXPECT_FALSE(begins(of_text[6]));
  // Of a choice: four lengths, three selectors; and what is in it.
  EXPECT_GE(make_spoilt_payloads(of({choice()}), max_size, random).size(), 7U);
  EXPECT_TRUE(make_spoilt_payloads(of({number(4)}), max_size, random).empty());
  EXPECT_EQ(make_spoilt_payloads(of(std::vector<Shape>(50, text())), 10, random).size(), 100U);
}

TEST(MutatePayload, TakesAnyBytesAndShapes) {
  Random random{3};
  const Shape list{.kind = Kind::list, .length = 2, .parts = {choice()}};
  const Shape all = of({list, {.kind = Kind::list, .fewest = 3, .most = 3, .parts = {list}}, of({})});
  for (int count = 0; count < 2'000; ++count) {
    Bytes payload(random.below(60));
    std::ranges::generate(payload, [&] { return static_cast<std::byte>(random.below(8)); });
    mutate_payload(payload, all, 100, random);
    EXPECT_LE(payload.size(), 100U);
  }
}

TEST(MutateTyped, ChangesThePayloadAloneAndOnlyOfWhatItKnows) {
  const KnownService service{.service = 0x1234, .methods = {7}, .payloads = {{7, of({number(4)})}}};
  Random random{4};
  Bytes request = make_request(service, 100, random);
  while (request.size() != 20 || request[3] != std::byte{7}) {
    request = make_request(service, 100, random);
  }
  bool changed = false;
  for (int count = 0; count < 20; ++count) {
    Bytes other = request;
    ASSERT_TRUE(mutate_typed(other, service, 100, random));
    EXPECT_TRUE(std::equal(other.begin(), other.begin() + 4, request.begin()));
    EXPECT_EQ(std::to_integer<std::size_t>(other[7]), other.size() - 8);
    changed = changed || !std::equal(other.begin() + 16, other.end(), request.begin() + 16, request.end());
  }
  EXPECT_TRUE(changed);
  request[3] = std::byte{8};
  EXPECT_FALSE(mutate_typed(request, service, 100, random));
  Bytes none;
  EXPECT_FALSE(mutate_typed(none, service, 100, random));
}

TEST(MakeNotification, IsAnEventOfTheService) {
  const KnownService service{.service = 0x1234, .events = {0x8001}};
  Random random{5};
  std::set<int> ids;
  for (int count = 0; count < 200; ++count) {
    const Bytes event = make_notification(service, 40, random);
    EXPECT_EQ(event[14], std::byte{0x02});
    EXPECT_EQ(event[2], std::byte{0x80});
    EXPECT_EQ(event[8], std::byte{});  // no client
    ids.insert(std::to_integer<int>(event[3]));
  }
  EXPECT_TRUE(ids.contains(1));
}

}  // namespace
}  // namespace trestle::fuzz::typed_test
