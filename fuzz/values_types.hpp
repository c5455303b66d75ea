#pragma once
#include "bridge/messages/values/message_values.hpp"
#include "fuzz/conversion_plans.hpp"

namespace trestle::fuzz {

/// Takes two bytes from `input`, which choose a type and wire rules; nothing when there are none.
inline const messages::MessageValues* choose_values(ByteView& input) {
  static const std::vector<std::vector<messages::MessageValues>> all = [] {
    std::vector<messages::TypeTree> trees{everything()};
    trees.push_back(
        {{*messages::parse_msg("bool a\nbyte[] b\nchar[3] c\nint8 d 7\nuint8[<=4] e\nint16 f\nuint16 g\n"
                               "int32 h\nuint32 i\nint64 j\nuint64 k\nfloat32[] l\nfloat64[] m\n"
                               "string n \"n\"\nwstring<=4 o\nstring<=3[<=2] p\nbool[2] q [1, 0]\n",
                               "fuzz_msgs/msg/Scalars", "Scalars")}});
    messages::TypeLibrary library;
    for (const char* const name :
         {"sensor_msgs/PointCloud2", "nav_msgs/Path", "std_msgs/Float32MultiArray"}) {
      trees.push_back(std::move(*library.resolve(name)));
    }
    std::vector<std::vector<messages::MessageValues>> result;
    for (const auto& tree : trees) {
      auto& of_type = result.emplace_back();
      for (const auto& rules : all_rules()) {
        of_type.push_back(std::move(*messages::MessageValues::make(tree, rules)));
      }
    }
    return result;
  }();
  if (input.size() < 2) {
    return nullptr;
  }
  const auto& of_type = all[std::to_integer<std::size_t>(input[0]) % all.size()];
  const auto& values = of_type[std::to_integer<std::size_t>(input[1]) % of_type.size()];
  input = input.subspan(2);
  return &values;
}

}  // namespace trestle::fuzz
