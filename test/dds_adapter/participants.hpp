#pragma once
#include "dds_adapter/participant.hpp"
#include "test/bytes.hpp"
#include "test/dds_adapter/dds_test.hpp"

namespace trestle::test {

using Participants = DdsTest;

inline constexpr const char* points_topic = "rt/points";
inline constexpr const char* points_type = "sensor_msgs::msg::dds_::PointCloud2_";

/// A callback that copies what comes.
inline dds::OnSample into(Inbox<std::vector<std::byte>>& inbox) {
  return [&inbox](const dds::Sample& sample) { inbox.put(copy(sample.cdr())); };
}

inline bool matched(const dds::Writer& writer, const dds::Reader& reader) {
  return eventually([&] { return writer.matched() == 1 && reader.matched() == 1; });
}

inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const dds::DdsError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace trestle::test
