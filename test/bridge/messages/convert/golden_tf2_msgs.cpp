#include "test/bridge/messages/convert/golden_builtin.hpp"

namespace trestle::test {

const std::vector<Golden>& tf2_msgs() {
  static const std::vector<Golden> all{
      {"tf2_msgs/TF2Error",
       {
           {"error 3", "03", "03"},
           {"error_string 'lost'", "000000 05000000 6c6f737400", "00000008 efbbbf 6c6f7374 00"},
       }},
  };
  return all;
}

}  // namespace trestle::test
