#pragma once
#include <map>
#include <optional>
#include <set>
#include <type_traits>
#include <utility>
#include <vector>

namespace trestle::describe::comparing {

/// Pairs elements of two lists: those of one name first, then those of one id, by the first key of several
/// that they share.
template <typename Element, typename Name, typename... Ids>
struct Pairs {
  std::vector<std::pair<const Element*, const Element*>> both;
  std::vector<const Element*> removed;
  std::vector<const Element*> added;

  Pairs(const std::vector<Element>& before, const std::vector<Element>& after, Name name, Ids... ids) {
    std::set<const Element*> taken;
    std::map<const Element*, const Element*> old_of;
    const auto pair_by = [&](auto key) {
      // Those of one key wait in the order in which they stand.
      std::map<std::decay_t<decltype(*key(before.front()))>, std::vector<const Element*>> waiting;
      for (auto old = before.rbegin(); old != before.rend(); ++old) {
        if (const auto of = key(*old); of && !taken.contains(&*old)) {
          waiting[*of].push_back(&*old);
        }
      }
      for (const Element& element : after) {
        const auto of = key(element);
        const auto found = of && !old_of.contains(&element) ? waiting.find(*of) : waiting.end();
        if (found != waiting.end() && !found->second.empty()) {
          old_of[&element] = found->second.back();
          taken.insert(found->second.back());
          found->second.pop_back();
        }
      }
    };
    pair_by([&](const Element& one) { return std::optional{name(one)}; });
    (pair_by(ids), ...);
    for (const Element& element : after) {
      if (const auto old = old_of.find(&element); old != old_of.end()) {
        both.emplace_back(old->second, &element);
      } else {
        added.push_back(&element);
      }
    }
    for (const Element& element : before) {
      if (!taken.contains(&element)) {
        removed.push_back(&element);
      }
    }
  }
};

}  // namespace trestle::describe::comparing
