#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "bridge/conform/fuzz/described.hpp"
#include "bridge/conform/fuzz/sequences.hpp"
#include "bridge/describe/interfaces.hpp"
#include "bridge/describe/layout.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "someip/wire/bytes.hpp"
#include "test/source_dir.hpp"

namespace trestle::conform::fuzz_typed_test {
namespace {

using testing::Contains;
using testing::UnorderedElementsAre;

describe::System system_of(const std::vector<std::string>& files) {
  std::vector<documents::Problem> problems;
  std::vector<std::string> paths;
  std::ranges::transform(files, std::back_inserter(paths),
                         [](const std::string& one) { return test::source_dir() + "/examples/" + one; });
  const auto texts = describe::load_sources(paths, problems);
  EXPECT_TRUE(problems.empty());
  describe::IdLock lock;
  describe::System system = make_system(read_sources(texts, describe::file_loader()), lock);
  EXPECT_TRUE(system.good);
  return system;
}

describe::System seat() {
  return system_of({"seat/Seat.fidl", "seat/Seat.fdepl"});
}

TEST(Described, KnowsMethodsFieldsEventsAndEventgroups) {
  const describe::System system = seat();
  fuzz::KnownService service{.service = 0x5ea7, .methods = {1, 0x77}};
  ASSERT_TRUE(add_described(service, system.model));
  EXPECT_THAT(service.methods, Contains(0x77));          // what was known before
  EXPECT_EQ(std::ranges::count(service.methods, 1), 1);  // the getter of `heating`
  EXPECT_THAT(service.methods, Contains(2));
  EXPECT_THAT(service.events, Contains(0x8001));
  EXPECT_THAT(service.eventgroups, UnorderedElementsAre(1, 2));
  EXPECT_TRUE(service.payloads.at(1).parts.empty());
  ASSERT_EQ(service.payloads.at(2).parts.size(), 1U);
  EXPECT_EQ(service.payloads.at(2).parts[0].kind, fuzz::Shape::Kind::number);
  EXPECT_FALSE(service.payloads.contains(0x77));

  fuzz::KnownService other{.service = 0x1111};
  EXPECT_FALSE(add_described(other, system.model));
}

/// What was made of each payload's type is mostly right by that type, and wherever it is right, the
/// shape says the same.
void expect_the_same_bytes(const describe::System& system) {
  const describe::Interfaces interfaces{system};
  fuzz::Random random{1};
  std::size_t kinds = 0;
  for (const describe::Service& service : system.model.services) {
    for (const describe::Method& method : service.methods) {
      const fuzz::Shape shape = shape_of(system.model, method.request);
      const auto* const element = interfaces.element(*service.id, service.major, *method.id);
      ASSERT_NE(element, nullptr);
      const auto& values = interfaces.content(*element).values;
      if (!values || !method.e2e.profile.empty()) {
        continue;
      }
      ++kinds;
      std::size_t good = 0;
      constexpr std::size_t rounds = 200;
      for (std::size_t count = 0; count < rounds; ++count) {
        fuzz::Bytes payload = fuzz::make_payload(shape, 100'000, random);
        good += values->fault_of(payload) ? 0U : 1U;
        fuzz::mutate_payload(payload, shape, 100'000, random);
        if (!values->fault_of(payload) &&
            describe::layout(system.model, method.request, payload).errors.empty()) {
          EXPECT_TRUE(fuzz::has_shape(payload, shape)) << method.name;
        }
      }
      EXPECT_GT(good, rounds * 7 / 10) << method.name;
    }
  }
  EXPECT_GT(kinds, 3U);
}

TEST(ShapeOf, IsThatOfFidlWithItsDeployment) {
  expect_the_same_bytes(seat());
  expect_the_same_bytes(system_of({"ets_device/ets.fidl", "ets_device/ets.fdepl"}));
}

TEST(ShapeOf, IsThatOfArxml) {
  expect_the_same_bytes(system_of({"seat/seat.arxml"}));
}

/// A structure with an optional member, bits, and a type that is not there.
TEST(ShapeOf, KnowsTagsAndBits) {
  describe::Model model;
  const auto number =
      model.add({.kind = describe::Kind::primitive, .primitive = messages::Primitive::uint16});
  const auto text = model.add({.kind = describe::Kind::string});
  const describe::Payload payload{.values = {{.type = number, .tag = someip::DataId{3}},
                                             {.type = text,
                                              .wire = describe::default_wire(describe::Kind::string),
                                              .tag = someip::DataId{4},
                                              .optional = true}}};
  const fuzz::Shape shape = shape_of(model, payload);
  ASSERT_EQ(shape.parts.size(), 2U);
  EXPECT_EQ(shape.parts[0].tag, 0x1003);
  EXPECT_EQ(shape.parts[1].tag, 0x4004);
  EXPECT_EQ(shape.parts[1].length, 4);
  EXPECT_TRUE(shape.parts[1].optional);

  describe::Wire three_bits;
  three_bits.bits = 3;
  EXPECT_EQ(shape_of(model, {.values = {{.type = number, .wire = three_bits}}}).parts[0].bits, 3);
  EXPECT_TRUE(shape_of(model, {.values = {{.type = describe::TypeIndex{99}}}}).parts[0].parts.empty());
}

/// Types that contain themselves end somewhere.
TEST(ShapeOf, EndsForTypesThatContainThemselves) {
  describe::Model model;
  const auto self = model.add({.kind = describe::Kind::structure});
  model.at(self).members = {{.name = "a", .type = self}, {.name = "b", .type = self}};
  fuzz::Random random{1};
  EXPECT_TRUE(fuzz::make_payload(shape_of(model, {.values = {{.type = self}}}), 100, random).empty());
}

/// As in examples/ets_device/planted_bugs.cpp: a text with BOM and without terminator.
bool is_text_without_end(const Step& step) {
  const fuzz::Bytes& b = step.bytes;
  return step.way == Way::udp && b.size() > 24 && someip::load<std::uint32_t>(b.data()) == 0x0101'0015 &&
         b[14] <= std::byte{1} && someip::load<std::uint32_t>(b.data() + 16) == b.size() - 20 &&
         someip::load<std::uint32_t>(b.data() + 19) ==
             0xefbbbfU + (std::to_integer<std::uint32_t>(b[19]) << 24U) &&
         b.back() != std::byte{};
}

std::size_t texts_without_end(const describe::Model* model) {
  const Sequences sequences{
      {{.service = {.service = 0x0101, .methods = {0x08, 0x09, 0x15, 0x19}}, .udp_port = 30501}},
      {},
      {.address = IpAddress::v4(10, 0, 0, 2), .port = 40490},
      model};
  fuzz::Random random{1};
  std::size_t found = 0;
  for (int count = 0; count < 3'000; ++count) {
    found += std::ranges::any_of(sequences.make(random).steps, is_text_without_end) ? 1U : 0U;
  }
  return found;
}

TEST(Sequences, ReachByTypeWhatAnyBytesDoNot) {
  const describe::System system = system_of({"ets_device/ets.fidl", "ets_device/ets.fdepl"});
  EXPECT_EQ(texts_without_end(nullptr), 0U);
  EXPECT_GT(texts_without_end(&system.model), 2U);
}

TEST(Sequences, BeginWithEachThingThatCanBeWrongInAPayload) {
  const describe::System system = system_of({"ets_device/ets.fidl", "ets_device/ets.fdepl"});
  const Sequences sequences{{{.service = {.service = 0x0101, .methods = {0x08}}, .udp_port = 30501}},
                            {},
                            {.address = IpAddress::v4(10, 0, 0, 2), .port = 40490},
                            &system.model};
  fuzz::Random random{1};
  const std::vector<Sequence> all = sequences.make_spoilt(random);
  EXPECT_EQ(std::ranges::count_if(
                all, [](const Sequence& one) { return std::ranges::any_of(one.steps, is_text_without_end); }),
            1);
  EXPECT_LT(all.size(), 200U);
  EXPECT_TRUE(Sequences({}, {}, {}, &system.model).make_spoilt(random).empty());
}

TEST(Sequences, SendEventsToWhereTheDeviceSubscribed) {
  const describe::System system = seat();
  Sequences sequences{
      {}, {{.service = 0x5ea7}}, {.address = IpAddress::v4(10, 0, 0, 2), .port = 40490}, &system.model};
  fuzz::Random random{1};
  const auto events = [&] {
    std::vector<fuzz::Bytes> all;
    for (int count = 0; count < 300; ++count) {
      for (const Step& step : sequences.make(random).steps) {
        if (step.way == Way::udp && step.port == 777) {
          all.push_back(step.bytes);
        }
      }
    }
    return all;
  };
  EXPECT_TRUE(events().empty());
  sequences.subscribed(0x5ea7, 777);
  const auto sent = events();
  EXPECT_GT(sent.size(), 50U);
  EXPECT_GT(std::ranges::count_if(sent,
                                  [](const fuzz::Bytes& one) {
                                    return one.size() > 16 &&
                                           someip::load<std::uint32_t>(one.data()) >> 4U == 0x5ea7'800U;
                                  }),
            20);
}

}  // namespace
}  // namespace trestle::conform::fuzz_typed_test
