#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "test/bytes.hpp"
#include "test/dds_adapter/dds_test.hpp"
#include "test/dds_adapter/peer_process.hpp"

namespace trestle::dds::data_sharing_test {
namespace {

using test::Inbox;
using testing::HasSubstr;
using testing::Not;
using Bytes = std::vector<std::byte>;

/// Histories that Fast DDS shares between processes tear loaned samples, and a sample that is larger than the
/// reader's bound makes it spin for ever. So ours are never among them, whoever wants it.
class DataSharing : public test::DdsTest {
 protected:
  DataSharing() { std::filesystem::create_directories(folder_); }
  ~DataSharing() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] static std::string files_in_memory() {
    std::ifstream maps{"/proc/self/maps"};
    return {std::istreambuf_iterator<char>{maps}, {}};
  }

  const std::string folder_ = testing::TempDir() + "trestle-sharing-" + std::to_string(getpid());
};

TEST_F(DataSharing, IsRefusedToAPeer) {
  Inbox<Bytes> inbox;
  Participant participant{config()};
  const Reader reader = participant.create_reader(
      "rt/bounded", "Bounded", {}, [&](const Sample& sample) { inbox.put(test::copy(sample.cdr())); });
  const test::PeerProcess peer{DATA_SHARING_PEER " " + std::to_string(domain_.id()) + " " + folder_};
  ASSERT_TRUE(inbox.wait_for_count(10));
  EXPECT_THAT(inbox.take(), testing::Each(test::hex("00010000 64617461")));
  // What the peer shares is there, but we have not opened it.
  EXPECT_FALSE(std::filesystem::is_empty(folder_));
  EXPECT_THAT(files_in_memory(), Not(HasSubstr("fast_datasharing")));
}

TEST_F(DataSharing, IsNotTakenFromAProfile) {
  const std::string file = folder_ + "/profiles.xml";
  std::ofstream{file} << R"(<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <participant profile_name="vehicle"><rtps/></participant>
  <data_writer profile_name="writer" is_default_profile="true"><qos><data_sharing><kind>ON</kind></data_sharing></qos></data_writer>
  <data_reader profile_name="reader" is_default_profile="true"><qos><data_sharing><kind>ON</kind></data_sharing></qos></data_reader>
</profiles></dds>)";
  ParticipantConfig profiled = config();
  profiled.profiles_file = file;
  profiled.profile = "vehicle";
  Participant from{profiled};
  Participant to{profiled};
  Inbox<Bytes> inbox;
  Writer writer = from.create_writer("rt/numbers", "Numbers", {});  // would throw: it has no bound
  const Reader reader = to.create_reader("rt/numbers", "Numbers", {},
                                         [&](const Sample& sample) { inbox.put(test::copy(sample.cdr())); });
  ASSERT_TRUE(test::eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  ASSERT_TRUE(writer.write(test::make_sample(100, 1)));
  ASSERT_TRUE(inbox.wait_for_count(1));
  EXPECT_EQ(inbox.take().front(), test::make_sample(100, 1));
  EXPECT_THAT(files_in_memory(), Not(HasSubstr("fast_datasharing")));
}

}  // namespace
}  // namespace trestle::dds::data_sharing_test
