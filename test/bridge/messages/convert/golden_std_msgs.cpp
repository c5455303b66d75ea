#include "test/bridge/messages/convert/golden_builtin.hpp"

namespace trestle::test {

// The layout of a MultiArray has 24 bytes of CDR here, its dimension 17 of SOME/IP: a string of 4 + 5 and two
// numbers. What gives IDL from .msg files puts one byte into an empty message.
const std::vector<Golden>& std_msgs() {
  static const std::vector<Golden> all{
      {"std_msgs/Bool",
       {
           {"data 1", "01", "01"},
       }},
      {"std_msgs/Byte",
       {
           {"data 254", "fe", "fe"},
       }},
      {"std_msgs/ByteMultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000 feff", "00000002 feff"},
       }},
      {"std_msgs/Char",
       {
           {"data 65", "41", "41"},
       }},
      {"std_msgs/Empty",
       {
           {"structure_needs_at_least_one_member 0", "00", "00"},
       }},
      {"std_msgs/Float32",
       {
           {"data 0.5", "0000003f", "3f000000"},
       }},
      {"std_msgs/Float32MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000008"},
           {"[0] 1.0", "0000803f", "3f800000"},
           {"[1] -1.0", "000080bf", "bf800000"},
       }},
      {"std_msgs/Float64",
       {
           {"data -1.0", "000000000000f0bf", "bff0000000000000"},
       }},
      {"std_msgs/Float64MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000010"},
           {"[0] 1.0", "00000000 000000000000f03f", "3ff0000000000000"},
           {"[1] -1.0", "000000000000f0bf", "bff0000000000000"},
       }},
      {"std_msgs/Int16",
       {
           {"data -2", "feff", "fffe"},
       }},
      {"std_msgs/Int16MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000004"},
           {"[0] -2", "feff", "fffe"},
           {"[1] 258", "0201", "0102"},
       }},
      {"std_msgs/Int32",
       {
           {"data -2", "feffffff", "fffffffe"},
       }},
      {"std_msgs/Int32MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000008"},
           {"[0] -2", "feffffff", "fffffffe"},
           {"[1] 258", "02010000", "00000102"},
       }},
      {"std_msgs/Int64",
       {
           {"data -2", "feffffffffffffff", "fffffffffffffffe"},
       }},
      {"std_msgs/Int64MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000010"},
           {"[0] -2", "00000000 feffffffffffffff", "fffffffffffffffe"},
           {"[1] 258", "0201000000000000", "0000000000000102"},
       }},
      {"std_msgs/Int8",
       {
           {"data -2", "fe", "fe"},
       }},
      {"std_msgs/Int8MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2: -2, 3", "02000000 fe03", "00000002 fe03"},
       }},
      {"std_msgs/MultiArrayDimension",
       {
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 3", "03000000", "00000003"},
       }},
      {"std_msgs/MultiArrayLayout",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
       }},
      {"std_msgs/UInt16",
       {
           {"data 258", "0201", "0102"},
       }},
      {"std_msgs/UInt16MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000004"},
           {"[0] 65534", "feff", "fffe"},
           {"[1] 258", "0201", "0102"},
       }},
      {"std_msgs/UInt32",
       {
           {"data 66051", "03020100", "00010203"},
       }},
      {"std_msgs/UInt32MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000008"},
           {"[0] 66051", "03020100", "00010203"},
           {"[1] 1", "01000000", "00000001"},
       }},
      {"std_msgs/UInt64",
       {
           {"data 283686952306183", "0706050403020100", "0001020304050607"},
       }},
      {"std_msgs/UInt64MultiArray",
       {
           {"layout.dim, 1 of 17 bytes", "01000000", "00000011"},
           {"label 'x'", "02000000 7800", "00000005 efbbbf 78 00"},
           {"size 2", "0000 02000000", "00000002"},
           {"stride 2", "02000000", "00000002"},
           {"data_offset 0", "00000000", "00000000"},
           {"data, 2", "02000000", "00000010"},
           {"[0] 283686952306183", "00000000 0706050403020100", "0001020304050607"},
           {"[1] 1", "0100000000000000", "0000000000000001"},
       }},
      {"std_msgs/UInt8",
       {
           {"data 200", "c8", "c8"},
       }},
  };
  return all;
}

}  // namespace trestle::test
