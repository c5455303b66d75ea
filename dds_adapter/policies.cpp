#include "dds_adapter/policies.hpp"

#include <array>
#include <chrono>

namespace trestle::dds::detail {

void check_endpoint(std::string_view what, std::string_view topic, std::string_view type, const Qos& qos) {
  constexpr std::size_t max_name = 255;       // of the strings in discovery
  constexpr std::uint32_t max_depth = 65536;  // well inside what Fast DDS can count
  const std::string subject = "DDS " + std::string{what} + " of topic '" + std::string{topic} + "': ";
  if (topic.empty() || topic.size() > max_name) {
    throw DdsError{subject + "a topic name has 1 to 255 characters"};
  }
  if (type.empty() || type.size() > max_name) {
    throw DdsError{subject + "the type name '" + std::string{type} + "' must have 1 to 255 characters"};
  }
  for (const std::chrono::nanoseconds time : {qos.deadline, qos.lifespan, qos.liveliness_lease}) {
    if (time.count() < 0 || time > std::chrono::hours{24 * 365}) {
      throw DdsError{subject + "its times must be from 0 to one year"};
    }
  }
  if (qos.depth < 1 || qos.depth > max_depth) {
    throw DdsError{subject + "history depth " + std::to_string(qos.depth) + " is out of range: 1 to " +
                   std::to_string(max_depth)};
  }
}

std::string differing_policies(const Qos& offered, const Qos& wanted) {
  using std::chrono::nanoseconds;
  const auto longer = [](nanoseconds offers, nanoseconds wants) {  // 0 is for ever
    return wants.count() != 0 && (offers.count() == 0 || offers > wants);
  };
  std::string result;
  const auto add = [&](bool differs, const char* name) {
    if (differs) {
      result.append(result.empty() ? "" : ", ").append(name);
    }
  };
  add(wanted.transient_local && !offered.transient_local, "durability");
  add(longer(offered.deadline, wanted.deadline), "deadline");
  add((wanted.manual_liveliness && !offered.manual_liveliness) ||
          longer(offered.liveliness_lease, wanted.liveliness_lease),
      "liveliness");
  add(wanted.reliable && !offered.reliable, "reliability");
  return result;
}

std::string risen_policies(const fast::QosPolicyCountSeq& now, fast::QosPolicyCountSeq& seen) {
  static constexpr std::array<const char*, 26> names{
      "",
      "user data",
      "durability",
      "presentation",
      "deadline",
      "latency budget",
      "ownership",
      "ownership strength",
      "liveliness",
      "time-based filter",
      "partition",
      "reliability",
      "destination order",
      "history",
      "resource limits",
      "entity factory",
      "writer data lifecycle",
      "reader data lifecycle",
      "topic data",
      "group data",
      "transport priority",
      "lifespan",
      "durability service",
      "data representation",
      "type consistency",
      "positive acknowledgements",
  };
  seen.resize(now.size());
  std::string result;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i].count > seen[i].count) {
      result += result.empty() ? "" : ", ";
      result += i < names.size() ? names[i] : "policy " + std::to_string(i);
    }
    seen[i] = now[i];
  }
  return result;
}

}  // namespace trestle::dds::detail
