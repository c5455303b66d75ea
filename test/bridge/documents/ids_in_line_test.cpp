#include "bridge/documents/ids_in_line.hpp"

#include <gtest/gtest.h>

namespace trestle::documents {
namespace {

TEST(IdsInLine, AreReplacedWhereverTheyStand) {
  const auto words = [](const IdsInLine& ids) {
    return "<" + ids.eventgroup_text + "|" + (ids.eventgroup ? std::to_string(*ids.eventgroup) : "") + "|" +
           ids.between + "|" + ids.service_text + "|" + std::to_string(ids.service) + "|" +
           ids.instance_text + ">";
  };
  EXPECT_EQ(with_ids_replaced("subscribed to eventgroup 0x0002 of 0x4711.0x0001, and 0x4712.* too", words),
            "subscribed to <eventgroup 0x0002|2| of |0x4711|18193|0x0001>, and <|||0x4712|18194|*> too");
  // Neither of these is a service with its instance.
  for (const char* line : {"", "event 0x8001", "at 10.0.0.1:30490", "0x4711", "90x4711.0x0001"}) {
    EXPECT_EQ(with_ids_replaced(line, words), line);
  }
}

}  // namespace
}  // namespace trestle::documents
