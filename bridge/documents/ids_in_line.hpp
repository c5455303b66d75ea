#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace trestle::documents {

/// Ids of a service in a line of a log: "eventgroup 0x0002 of 0x4711.0x0001", "0x4711.*".
struct IdsInLine {
  std::string eventgroup_text{};  ///< "eventgroup 0x0002"; empty: there is none in front
  std::optional<std::uint16_t> eventgroup{};
  std::string between{};       ///< " of "
  std::string service_text{};  ///< "0x4711"
  std::uint16_t service = 0;
  std::string instance_text{};  ///< "0x0001", "*"
};

/// A line in which `words` says what stands for the ids.
[[nodiscard]] std::string with_ids_replaced(const std::string& line,
                                            const std::function<std::string(const IdsInLine&)>& words);

}  // namespace trestle::documents
