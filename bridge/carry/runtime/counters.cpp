#include "bridge/carry/runtime/counters.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>

namespace trestle::carry {

void add(CounterGroup& sum, const Counter& counter) {
  const auto same = std::ranges::find(sum.counters, std::string_view{counter.name},
                                      [](const Counter& one) { return std::string_view{one.name}; });
  if (same == sum.counters.end()) {
    sum.counters.push_back(counter);
  } else {
    same->count += counter.count;
  }
}

void add(CounterGroup& sum, const CounterGroup& ended) {
  for (const Counter& counter : ended.counters) {
    if (counter.kind != Counter::Kind::now) {
      add(sum, counter);
    }
  }
}

std::string to_string(const CounterGroup& group) {
  std::string traffic;
  std::string losses;
  std::string doubts;
  for (const Counter& counter : group.counters) {
    using Kind = Counter::Kind;
    if (counter.says_nothing()) {
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
  for (const Label& label : group.labels) {
    line["labels"][label.name] = label.value;
  }
  for (const Counter& counter : group.counters) {
    line[counter.name] = counter.count;
  }
  return line.dump();
}

}  // namespace trestle::carry
