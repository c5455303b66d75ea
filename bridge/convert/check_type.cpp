#include "bridge/convert/check_type.hpp"

#include "bridge/convert/conversion_plan.hpp"
#include "bridge/types/type_library.hpp"

namespace trestle::bridge {

std::string check_type(const std::string& type, const std::vector<std::string>& folders,
                       const MessageRules& rules) {
  TypeLibrary library{{folders.begin(), folders.end()}, ament_prefixes()};
  const auto tree = library.resolve(type);
  if (!tree) {
    return to_string(tree.error());
  }
  const auto plan = ConversionPlan::compile(*tree, rules);
  return plan ? std::string{} : plan.error();
}

}  // namespace trestle::bridge
