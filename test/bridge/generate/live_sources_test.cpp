#include "bridge/generate/live_sources.hpp"

#include <gmock/gmock.h>

#include "bridge/generate/source_options.hpp"

namespace trestle::generate {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> found(const std::vector<dds::FoundWriter>& graph,
                               const std::vector<std::string>& only = {}) {
  std::vector<std::string> names;
  for (const describe::RosInterface& one : interfaces_of(graph, only, "ros")) {
    names.push_back(one.name + " " + one.type);
  }
  return names;
}

TEST(InterfacesOf, FindsTopicsServicesAndActions) {
  const std::vector<dds::FoundWriter> graph{
      {.topic = "rt/points", .type = "sensor_msgs::msg::dds_::PointCloud2_"},
      {.topic = "rt/points", .type = "sensor_msgs::msg::dds_::PointCloud2_"},
      {.topic = "rr/arm/enableReply", .type = "std_srvs::srv::dds_::SetBool_Response_"},
      {.topic = "rr/look/_action/send_goalReply",
       .type = "tf2_msgs::action::dds_::LookupTransform_SendGoal_Response_"},
      {.topic = "rr/look/_action/get_resultReply",
       .type = "tf2_msgs::action::dds_::LookupTransform_GetResult_Response_"},
      {.topic = "rt/look/_action/feedback",
       .type = "tf2_msgs::action::dds_::LookupTransform_FeedbackMessage_"}};
  EXPECT_THAT(found(graph),
              ElementsAre("/arm/enable std_srvs/srv/SetBool", "/look tf2_msgs/action/LookupTransform",
                          "/points sensor_msgs/msg/PointCloud2"));
}

TEST(InterfacesOf, LeavesOutWhatEveryNodeHas) {
  const std::vector<dds::FoundWriter> graph{
      {.topic = "rt/rosout", .type = "rcl_interfaces::msg::dds_::Log_"},
      {.topic = "rt/parameter_events", .type = "rcl_interfaces::msg::dds_::ParameterEvent_"},
      {.topic = "rr/node/get_parametersReply", .type = "rcl_interfaces::srv::dds_::GetParameters_Response_"},
      {.topic = "ros_discovery_info", .type = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"},
      {.topic = "Square", .type = "ShapeType"}};
  EXPECT_THAT(found(graph), IsEmpty());
  EXPECT_THAT(found(graph, {"/rosout"}), ElementsAre("/rosout rcl_interfaces/msg/Log"));
}

TEST(InterfacesOf, TakesWhatOnlyBridgesHaveWhereItIsNamed) {
  const std::vector<dds::FoundWriter> graph{
      {.topic = "rt/from_car", .type = "std_msgs::msg::dds_::Bool_", .bridge = true},
      {.topic = "rt/both", .type = "std_msgs::msg::dds_::Bool_", .bridge = true},
      {.topic = "rt/both", .type = "std_msgs::msg::dds_::Bool_"},
      {.topic = "rt/rosout", .type = "rcl_interfaces::msg::dds_::Log_", .bridge = true},
      {.topic = "rr/door/openReply", .type = "std_srvs::srv::dds_::SetBool_Response_", .bridge = true}};
  EXPECT_THAT(found(graph), ElementsAre("/both std_msgs/msg/Bool"));
  EXPECT_THAT(brought_by_bridges(graph), ElementsAre("/door/open", "/from_car"));
  EXPECT_THAT(found(graph, {"/from_car", "/door/open"}),
              ElementsAre("/door/open std_srvs/srv/SetBool", "/from_car std_msgs/msg/Bool"));
}

TEST(FormOf, TellsSourcesApart) {
  EXPECT_EQ(form_of("drive.pcapng"), SourceForm::capture);
  EXPECT_EQ(form_of("bridge.yaml"), SourceForm::route_file);
  EXPECT_EQ(form_of("network"), SourceForm::network);
  EXPECT_EQ(form_of("network:eth0"), SourceForm::network);
  EXPECT_EQ(form_of("ros:42"), SourceForm::ros);
  EXPECT_EQ(form_of("sensor_msgs/msg/PointCloud2"), SourceForm::type);
  EXPECT_EQ(form_of("std_srvs/SetBool"), SourceForm::type);
  EXPECT_EQ(form_of("/points"), SourceForm::topic);
  EXPECT_EQ(form_of("/tmp"), SourceForm::file);
  EXPECT_EQ(form_of("none/Door.fidl"), SourceForm::file);
}

}  // namespace
}  // namespace trestle::generate
