#include "bridge/carry/runtime/counters.hpp"

#include <nlohmann/json.hpp>

namespace trestle::carry {

std::string to_string(const CounterGroup& group) {
  std::string traffic;
  std::string losses;
  std::string doubts;
  for (const Counter& counter : group.counters) {
    using Kind = Counter::Kind;
    if (counter.kind != Kind::traffic && counter.count == 0) {
      continue;
    }
    std::string& text = counter.kind == Kind::loss ? losses : counter.kind == Kind::doubt ? doubts : traffic;
    text += text.empty() ? "" : ", ";
    text += std::string{counter.name} + " " + std::to_string(counter.count);
  }
  std::string line = traffic;
  const auto add = [&](const char* title, const std::string& text) {
    line += text.empty() ? "" : (line.empty() ? "" : "; ") + (title + text);
  };
  add("lost: ", losses);
  add("perhaps lost: ", doubts);
  return group.name + ": " + line;
}

std::string to_json(const CounterGroup& group) {
  nlohmann::ordered_json line{{"event", "counters"}, {"group", group.name}};
  for (const Counter& counter : group.counters) {
    line[counter.name] = counter.count;
  }
  return line.dump();
}

}  // namespace trestle::carry
