#pragma once
#include <map>
#include <string>
#include <vector>

#include "bridge/record/mcap.hpp"

namespace trestle::record {

/// A topic of a bag: what was recorded as CDR.
struct BagTopic {
  std::string name{};
  std::string type{};
  std::string qos{};  ///< offered_qos()
  std::uint64_t messages = 0;
};

/// A file of a bag.
struct BagFile {
  std::string name{};  ///< in the folder
  LogTime start = 0;
  LogTime end = 0;
  std::uint64_t messages = 0;
};

/// What makes a folder a bag of rosbag2: the text of `metadata.yaml`, of version 5, which every distribution
/// since Humble reads. Messages that are no CDR are not in it, as rosbag2 and rosbags refuse a bag that names
/// others.
[[nodiscard]] std::string bag_metadata(const std::vector<BagTopic>& topics,
                                       const std::vector<BagFile>& files);

}  // namespace trestle::record
