#pragma once
#include "test/bridge/messages/convert/golden_fields.hpp"

/// The built-in types that golden_messages_test.cpp and golden_test.cpp leave out, as tables, a file for each
/// package. See golden_fields.hpp for what the columns say. Two headers are used: with the frame "map" one
/// has 16 bytes of CDR, so that numbers follow it without padding; with "odom" it has 17.
namespace trestle::test {

struct Golden {
  const char* type;
  std::vector<GoldenField> fields;
};

const std::vector<Golden>& geometry_msgs();
const std::vector<Golden>& nav_msgs();
const std::vector<Golden>& sensor_msgs();
const std::vector<Golden>& std_msgs();
const std::vector<Golden>& tf2_msgs();

}  // namespace trestle::test
