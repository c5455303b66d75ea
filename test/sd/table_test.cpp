// A table of slots in the caller's memory, and what becomes of handles of slots that are used again.
#include "sd/core/table.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "sd/core/find_id.hpp"

namespace trestle::sd::table_test {
namespace {

struct Slot : SlotBase {
  int value = 7;
};
using SlotHandle = Handle<struct OfTheTest>;

TEST(Table, GivesOutItsSlotsEmptyAndOnce) {
  std::array<Slot, 2> slots;
  Table<Slot> table{slots};
  EXPECT_EQ(table.free_slots(), 2U);
  Slot* const first = table.add();
  Slot* const second = table.add();
  ASSERT_TRUE(first != nullptr && second != nullptr);
  EXPECT_NE(first, second);
  EXPECT_EQ(table.add(), nullptr);
  EXPECT_EQ(table.free_slots(), 0U);
  first->value = 1;
  second->value = 2;
  EXPECT_EQ(table.find_if([](const Slot& slot) { return slot.value == 2; }), second);
  table.remove(*first);
  EXPECT_EQ(table.find_if([](const Slot& slot) { return slot.value == 1; }), nullptr);
  EXPECT_EQ(table.find_if([](const Slot& slot) { return slot.value == 2; }), second);
  EXPECT_EQ(table.add(), first);
  EXPECT_EQ(first->value, 7);
}

TEST(Table, SearchesEachSlotFromTheLastFoundOn) {
  std::array<Slot, 3> slots;
  Table<Slot> table{slots};
  for (int value = 0; value < 3; ++value) {
    table.add()->value = value;
  }
  int looked_at = 0;
  const auto search = [&](int wanted, bool in_order = false) {
    looked_at = 0;
    const Slot* const found = table.search(
        [&](const Slot& slot) {
          ++looked_at;
          return slot.value == wanted;
        },
        in_order);
    return found == nullptr ? -1 : found->value;
  };
  EXPECT_EQ(search(1), 1);
  EXPECT_EQ(search(2), 2);
  EXPECT_EQ(looked_at, optimised_for_many ? 2 : 3);  // the one before, and itself
  EXPECT_EQ(search(2), 2);
  EXPECT_EQ(looked_at, optimised_for_many ? 1 : 3);
  EXPECT_EQ(search(0), 0);
  EXPECT_EQ(search(3), -1);
  EXPECT_EQ(looked_at, 3);
  EXPECT_EQ(search(2), 2);
  EXPECT_EQ(search(2, true), 2);
  EXPECT_EQ(looked_at, 3);
  table.remove(slots[2]);  // where the next search would begin
  EXPECT_EQ(search(1), 1);
  table.remove(slots[0]);
  table.remove(slots[1]);
  EXPECT_EQ(search(1), -1);
  EXPECT_EQ(table.free_slots(), 3U);
  EXPECT_EQ(table.add(), &slots[0]);
  EXPECT_EQ(table.add(), &slots[1]);
  EXPECT_EQ(table.free_slots(), 1U);
}

TEST(Table, KnowsOldHandlesFromNewOnesForLong) {
  std::array<Slot, 1> slots;
  Table<Slot> table{slots};
  for (std::uint32_t use = 1; use <= 0xffff; ++use) {
    Slot* const slot = table.add();
    ASSERT_NE(slot, nullptr);
    const auto handle = table.handle_of<SlotHandle>(*slot);
    ASSERT_EQ(handle.generation, use);
    ASSERT_EQ(table.find(handle), slot);
    table.remove(*slot);
    ASSERT_EQ(table.find(handle), nullptr);
  }
  // 0 is left out, which is that of a handle of nothing.
  Slot* const slot = table.add();
  ASSERT_NE(slot, nullptr);
  EXPECT_EQ(table.handle_of<SlotHandle>(*slot).generation, 1U);
  EXPECT_EQ(table.find(SlotHandle{}), nullptr);
}

TEST(Table, FindsServicesAtEachPlaceOfItsIds) {
  constexpr someip::ServiceId wanted{0x1234};
  for (std::size_t size = 0; size <= 100; ++size) {
    std::vector<someip::ServiceId> ids(size, someip::ServiceId{0x1235});
    EXPECT_EQ(find_id(ids, wanted), size);
    for (std::size_t place = 0; place < size; ++place) {
      ids[place] = wanted;
      EXPECT_EQ(find_id(ids, wanted), place);
      EXPECT_EQ(find_id(ids, wanted, place), place);
      EXPECT_EQ(find_id(ids, wanted, place + 1), size);
      if (place + 40 < size) {
        ids[place + 40] = wanted;
        EXPECT_EQ(find_id(ids, wanted, place + 1), place + 40);
        ids[place + 40] = someip::ServiceId{0x1235};
      }
      ids[place] = someip::ServiceId{0x1235};
    }
  }
}

}  // namespace
}  // namespace trestle::sd::table_test
