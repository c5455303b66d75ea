#include "test/bridge/messages/convert/golden_builtin.hpp"

namespace trestle::test {

// A PoseStamped as an element of Goals: a stamp of 8 bytes, a string of 4 + 7, seven numbers of 8: 75.
const std::vector<Golden>& nav_msgs() {
  static const std::vector<Golden> all{
      {"nav_msgs/Goals",
       {
           {"stamp.sec 1", "01000000", "00000001"},
           {"stamp.nanosec 2", "02000000", "00000002"},
           {"frame_id 'map'", "04000000 6d617000", "00000007 efbbbf 6d6170 00"},
           {"goals, 1 of 75 bytes", "01000000", "0000004b"},
           {"stamp.sec 1", "01000000", "00000001"},
           {"stamp.nanosec 2", "02000000", "00000002"},
           {"frame_id 'map'", "04000000 6d617000", "00000007 efbbbf 6d6170 00"},
           {"position.x 1.0", "00000000 000000000000f03f", "3ff0000000000000"},
           {"position.y -2.0", "00000000000000c0", "c000000000000000"},
           {"position.z 0.5", "000000000000e03f", "3fe0000000000000"},
           {"orientation.x 0.0", "0000000000000000", "0000000000000000"},
           {"orientation.y 0.5", "000000000000e03f", "3fe0000000000000"},
           {"orientation.z -1.0", "000000000000f0bf", "bff0000000000000"},
           {"orientation.w 0.25", "000000000000d03f", "3fd0000000000000"},
       }},
      {"nav_msgs/GridCells",
       {
           {"stamp.sec 1", "01000000", "00000001"},
           {"stamp.nanosec 2", "02000000", "00000002"},
           {"frame_id 'odom'", "05000000 6f646f6d00", "00000008 efbbbf 6f646f6d 00"},
           {"cell_width 0.5", "000000 0000003f", "3f000000"},
           {"cell_height 0.25", "0000803e", "3e800000"},
           {"cells, 2 of 24 bytes", "02000000", "00000030"},
           {"[0].x 1.0", "000000000000f03f", "3ff0000000000000"},
           {"[0].y 2.0", "0000000000000040", "4000000000000000"},
           {"[0].z 3.0", "0000000000000840", "4008000000000000"},
           {"[1].x -1.0", "000000000000f0bf", "bff0000000000000"},
           {"[1].y 0.5", "000000000000e03f", "3fe0000000000000"},
           {"[1].z 0.0", "0000000000000000", "0000000000000000"},
       }},
      {"nav_msgs/MapMetaData",
       {
           {"sec 1", "01000000", "00000001"},
           {"nanosec 2", "02000000", "00000002"},
           {"resolution 0.5", "0000003f", "3f000000"},
           {"width 3", "03000000", "00000003"},
           {"height 4", "04000000", "00000004"},
           {"origin.position.x 1.0", "00000000 000000000000f03f", "3ff0000000000000"},
           {"origin.position.y -2.0", "00000000000000c0", "c000000000000000"},
           {"origin.position.z 0.5", "000000000000e03f", "3fe0000000000000"},
           {"origin.orientation.x 0.0", "0000000000000000", "0000000000000000"},
           {"origin.orientation.y 0.5", "000000000000e03f", "3fe0000000000000"},
           {"origin.orientation.z -1.0", "000000000000f0bf", "bff0000000000000"},
           {"origin.orientation.w 0.25", "000000000000d03f", "3fd0000000000000"},
       }},
  };
  return all;
}

}  // namespace trestle::test
