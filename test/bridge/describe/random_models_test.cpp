// Models of any kind: what they carry survives the way to bytes and back.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "bridge/describe/raise.hpp"
#include "test/bridge/describe/lowered.hpp"
#include "test/bridge/describe/random_values.hpp"

namespace trestle::describe::random_models_test {
namespace {

using lowered::array_of;
using lowered::event;
using lowered::library_of;
using lowered::number;
using lowered::structure;
using lowered::text;
using lowered::value;

using messages::Primitive;
using someip::FieldWidth;

class RandomModel {
 public:
  explicit RandomModel(unsigned seed) : random_{seed} {
    for (std::size_t i = 0; i < 3 + pick(6); ++i) {
      named_.push_back(named(i));
    }
    std::vector<Value> values;
    for (std::size_t i = 0; i < 1 + pick(5); ++i) {
      values.push_back(use("argument" + std::to_string(i), 0));
    }
    Event& one = event(model_, std::move(values));
    one.payload.byte_order = pick(2) == 0 ? std::endian::big : std::endian::little;
    one.payload.length_fields_always_big = pick(2) == 0;
    one.payload.alignment = pick(4) == 0 ? 4 : 1;
  }

  [[nodiscard]] const Model& model() const { return model_; }

 private:
  unsigned pick(unsigned below) { return static_cast<unsigned>(random_()) % below; }
  FieldWidth long_width() { return pick(4) == 0 ? FieldWidth::bits16 : FieldWidth::bits32; }

  TypeIndex named(std::size_t index) {
    const bool is_choice = pick(4) == 0;
    std::vector<Value> members;
    for (std::size_t i = 0; i < 1 + pick(5); ++i) {
      members.push_back(use("member" + std::to_string(i), 0));
    }
    const TypeIndex type = structure(model_, "Type" + std::to_string(index), std::move(members));
    if (is_choice) {
      Type& choice = model_.at(type);
      choice.kind = Kind::choice;
      choice.wire = default_wire(Kind::choice);
      if (pick(2) == 0) {
        for (std::uint32_t i = 0; i < choice.members.size(); ++i) {
          choice.selectors.push_back(200 - 3 * i);
        }
      }
    } else if (!named_.empty() && pick(3) == 0 && model_.at(named_.back()).kind == Kind::structure) {
      model_.at(type).base = named_.back();
    }
    return type;
  }

  Value use(std::string name, unsigned depth) {
    Value made;
    const unsigned kind = pick(depth < 2 ? 9 : 4);
    if (kind == 0) {
      made = value(model_, std::move(name), text(model_));
      constexpr std::array encodings{someip::StringEncoding::utf8, someip::StringEncoding::utf16le,
                                     someip::StringEncoding::utf16be};
      made.wire.encoding = encodings[pick(3)];
      made.wire.bom = pick(3) != 0;
      made.wire.terminator = pick(3) != 0;
      made.wire.length = pick(5) == 0   ? FieldWidth::none
                         : pick(3) == 0 ? FieldWidth::bits8
                                        : FieldWidth::bits32;
      made.wire.fixed_bytes = made.wire.length == FieldWidth::none ? 64 : 0;
    } else if (kind == 1) {
      constexpr std::array primitives{Primitive::boolean, Primitive::float32, Primitive::float64};
      made = value(model_, std::move(name), number(model_, primitives[pick(3)]));
    } else if (kind == 2) {
      constexpr std::array primitives{Primitive::uint8, Primitive::int8,  Primitive::uint16, Primitive::int16,
                                      Primitive::int32, Primitive::int64, Primitive::uint64};
      made = value(model_, std::move(name), number(model_, primitives[pick(7)]));
      if (pick(2) == 0) {
        made.wire.bits =
            static_cast<std::uint8_t>(2 + pick(8U * messages::width(model_.at(made.type).primitive) - 2));
      }
    } else if (kind == 3) {
      Type levels{
          .kind = Kind::enumeration, .name = "Level", .scope = "org.test", .primitive = Primitive::uint16};
      levels.enumerators = {{.name = "lowLevel", .value = 0}, {.name = "HIGH", .value = 700}};
      made = value(model_, std::move(name), model_.add(std::move(levels)));
    } else if (kind < 6 && !named_.empty()) {
      made = value(model_, std::move(name), named_[pick(static_cast<unsigned>(named_.size()))]);
      const bool is_choice = model_.at(made.type).kind == Kind::choice;
      made.wire.length = is_choice || pick(2) == 0 ? long_width() : FieldWidth::none;
      made.wire.selector = pick(2) == 0 ? FieldWidth::bits8 : FieldWidth::bits32;
      made.wire.length_first = pick(2) == 0;
      if (is_choice && pick(4) == 0) {
        made.wire.length = FieldWidth::none;
      }
    } else if (kind == 6) {
      Type bytes{.kind = Kind::bytes, .wire = default_wire(Kind::bytes)};
      bytes.max_size = pick(2) * 7;
      made = value(model_, std::move(name), model_.add(std::move(bytes)));
      made.wire.length = long_width();
    } else if (kind == 7) {
      Type map{.kind = Kind::map, .wire = default_wire(Kind::map)};
      map.key = whole(use("", depth + 1));
      map.element = whole(use("", depth + 1));
      made = value(model_, std::move(name), model_.add(std::move(map)));
      made.wire.length = long_width();
    } else {
      const Value element = use("", depth + 1);
      const TypeIndex index = array_of(model_, element);
      model_.at(index).max_size = pick(3);
      model_.at(index).fixed_size = model_.at(index).max_size != 0 && pick(2) == 0;
      if (!model_.at(index).fixed_size) {
        model_.at(index).element = whole(element);
      }
      made = value(model_, std::move(name), index);
      made.wire.length = model_.at(index).fixed_size && pick(2) == 0 ? FieldWidth::none : long_width();
    }
    return made;
  }

  /// Without bits: arrays of no fixed size have none.
  static Value whole(Value value) {
    value.wire.bits = 0;
    return value;
  }

  std::minstd_rand random_;
  Model model_;
  std::vector<TypeIndex> named_;
};

TEST(RandomModels, CarryTheirValuesBothWays) {
  std::size_t carried = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    const RandomModel random{seed};
    const Lowered lowered = lower(random.model());
    ASSERT_EQ(lowered.members.size(), 1U) << (lowered.not_carried.empty() ? "" : lowered.not_carried[0].what);
    const LoweredMember& member = lowered.members[0];
    const auto tree = library_of(lowered).resolve(member.type);
    ASSERT_TRUE(tree) << to_string(tree.error());
    carried += random_values::carried(*tree, member.rules, 8);
    if (testing::Test::HasFailure()) {
      return;
    }
  }
  EXPECT_EQ(carried, 300U * 8U);
}

/// Of big endian payloads both mean the same.
messages::MessageRules with_one_length_order(messages::MessageRules rules) {
  rules.payload.length_fields_always_big |= rules.payload.byte_order == std::endian::big;
  return rules;
}

TEST(RandomModels, ComeBackFromTypesAndRules) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    const RandomModel random{seed};
    const Lowered lowered = lower(random.model());
    ASSERT_EQ(lowered.members.size(), 1U);
    const LoweredMember& member = lowered.members[0];
    const auto tree = library_of(lowered).resolve(member.type);
    ASSERT_TRUE(tree) << to_string(tree.error());

    Model raised;
    std::vector<std::string> lost;
    RaisedTypes types{raised};
    event(raised, {}).payload = raise(types, *tree, member.rules, "data", lost);
    EXPECT_EQ(lost.size(), member.rules.default_missing ? 1U : 0U) << lost[0];
    const Lowered again = lower(raised);
    ASSERT_EQ(again.members.size(), 1U);
    EXPECT_EQ(again.members[0].type, member.type);
    EXPECT_EQ(with_one_length_order(again.members[0].rules), with_one_length_order(member.rules));
    for (const messages::MessageDefinition& definition : tree->messages) {
      const messages::MessageDefinition* const same = again.definition(definition.name);
      ASSERT_NE(same, nullptr) << definition.name;
      EXPECT_TRUE(std::ranges::equal(same->fields, definition.fields,
                                     [](const messages::Field& left, const messages::Field& right) {
                                       messages::FieldType type = right.type;
                                       type.message_index = left.type.message_index;
                                       return left.name == right.name && left.type == type &&
                                              left.default_value == right.default_value;
                                     }))
          << definition.name;
    }
    if (testing::Test::HasFailure()) {
      return;
    }
  }
}

TEST(RandomModels, GiveTheSameNamesEachTime) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Lowered first = lower(RandomModel{seed}.model());
    const Lowered second = lower(RandomModel{seed}.model());
    EXPECT_EQ(first.sources, second.sources);
    ASSERT_EQ(first.definitions.size(), second.definitions.size());
    for (std::size_t i = 0; i < first.definitions.size(); ++i) {
      EXPECT_EQ(msg_text(first, first.definitions[i]), msg_text(second, second.definitions[i]));
    }
    EXPECT_EQ(first.members[0].rules, second.members[0].rules);
  }
}

}  // namespace
}  // namespace trestle::describe::random_models_test
