#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "bridge/record/bag_metadata.hpp"

// That rosbags takes the folder is in mcap_peers_test.py.
namespace trestle::record {
namespace bag_metadata_test {

TEST(BagMetadata, TellsOfAllFilesTogether) {
  const YAML::Node all =
      YAML::Load(bag_metadata({{"/a", "std_msgs/msg/String", "- history: 3\n", 5}},
                              {{"a_0.mcap", 100, 200, 4}, {"a_1.mcap", 250, 300, 2}, {"a_2.mcap", 0, 0, 0}}));
  const YAML::Node bag = all["rosbag2_bagfile_information"];
  EXPECT_EQ(bag["version"].as<int>(), 5);
  EXPECT_EQ(bag["duration"]["nanoseconds"].as<int>(), 200);
  EXPECT_EQ(bag["starting_time"]["nanoseconds_since_epoch"].as<int>(), 100);
  EXPECT_EQ(bag["message_count"].as<int>(), 5) << "what is no CDR is not in it";
  EXPECT_EQ(bag["relative_file_paths"].size(), 3U);
  EXPECT_EQ(bag["files"][1]["starting_time"]["nanoseconds_since_epoch"].as<int>(), 250);
  EXPECT_EQ(bag["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"].as<std::string>(),
            "- history: 3\n");
}

}  // namespace bag_metadata_test
}  // namespace trestle::record
