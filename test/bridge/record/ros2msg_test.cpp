#include <gtest/gtest.h>

#include <fstream>

#include "bridge/messages/types/type_library.hpp"
#include "bridge/record/ros2msg.hpp"

// That others read the schemas of all types that are compiled in is in mcap_peers_test.py.
namespace trestle::record {
namespace ros2msg_test {

TEST(Ros2Msg, HasTheTypeThenAllThatIsInIt) {
  messages::TypeLibrary types;
  EXPECT_EQ(ros2msg(types.resolve("std_msgs/msg/Header").value()),
            "builtin_interfaces/Time stamp\n"
            "string frame_id\n"
            "================================================================================\n"
            "MSG: builtin_interfaces/Time\n"
            "int32 sec\n"
            "uint32 nanosec\n");
}

TEST(Ros2Msg, IsEmptyForATypeWithoutFields) {
  messages::TypeLibrary types;
  EXPECT_EQ(ros2msg(types.resolve("std_msgs/msg/Empty").value()), "");
}

// "TRUE" and a constant in a module of its own are no words of .msg files.
TEST(Ros2Msg, LeavesOutWhatOnlyIdlFilesCanSay) {
  messages::TypeTree tree;
  tree.messages.push_back({.name = "a/msg/B",
                           .file = {},
                           .fields = {{.name = "on",
                                       .type = {.primitive = messages::Primitive::boolean},
                                       .default_value = "TRUE",
                                       .line = 0,
                                       .column = 0}},
                           .constants = {{.name = "C", .value = "'x'"}},
                           .is_idl = true});
  EXPECT_EQ(ros2msg(tree), "bool on\n");
}

}  // namespace ros2msg_test
}  // namespace trestle::record
