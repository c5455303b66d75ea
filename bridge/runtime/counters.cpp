#include "bridge/runtime/counters.hpp"

#include <nlohmann/json.hpp>

namespace trestle::bridge {

std::string to_string(const CounterGroup& group) {
  std::string traffic;
  std::string losses;
  for (const Counter& counter : group.counters) {
    const bool loss = counter.kind == Counter::Kind::loss;
    if (loss && counter.count == 0) {
      continue;
    }
    std::string& text = loss ? losses : traffic;
    text += text.empty() ? "" : ", ";
    text += std::string{counter.name} + " " + std::to_string(counter.count);
  }
  return group.name + ": " + traffic +
         (losses.empty() ? "" : (traffic.empty() ? "lost: " : "; lost: ") + losses);
}

std::string to_json(const CounterGroup& group) {
  nlohmann::ordered_json line{{"event", "counters"}, {"group", group.name}};
  for (const Counter& counter : group.counters) {
    line[counter.name] = counter.count;
  }
  return line.dump();
}

}  // namespace trestle::bridge
