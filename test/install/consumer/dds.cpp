#include <trestle/dds_adapter/participant.hpp>
#include <trestle/dds_adapter/ros_names.hpp>

int main() {
  try {
    const trestle::dds::Participant nobody{{.domain = 1000}};
  } catch (const trestle::dds::DdsError&) {
    return trestle::dds::ros_topic_name("/points") == "rt/points" ? 0 : 1;
  }
  return 1;
}
