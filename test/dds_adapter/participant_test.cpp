#include "dds_adapter/participant.hpp"

#include <gmock/gmock.h>

#include <thread>

#include "test/dds_adapter/dds_test.hpp"

namespace trestle::dds {
namespace {

using test::copy;
using test::eventually;
using test::Inbox;
using test::make_sample;
using testing::ElementsAre;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;
using Participants = test::DdsTest;

const char* const topic = "rt/points";
const char* const type = "sensor_msgs::msg::dds_::PointCloud2_";

TEST_F(Participants, CarrySamplesOfAllSizesUnchanged) {
  Participant from{config()};
  Participant to{config()};
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer(topic, type, {});
  const Reader reader =
      to.create_reader(topic, type, {}, [&](const Sample& sample) { inbox.put(copy(sample.cdr())); });
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  std::size_t count = 0;
  for (const std::size_t size : {4U, 8U, 64U, 1024U, 65'000U, 70'000U, 1'000'000U, 4'000'000U, 16'777'216U}) {
    const Bytes sample = make_sample(size, static_cast<std::uint32_t>(size));
    ASSERT_TRUE(writer.write(sample));
    ASSERT_TRUE(inbox.wait_for_count(1)) << size;
    const auto received = inbox.take();
    EXPECT_TRUE(received[0] == sample) << size;
    ++count;
  }
  EXPECT_EQ(reader.counters().received, count);
  EXPECT_EQ(writer.counters().sent, count);
}

}  // namespace
}  // namespace trestle::dds
