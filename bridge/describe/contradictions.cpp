#include "bridge/describe/contradictions.hpp"

#include <fmt/format.h>

#include "bridge/describe/join.hpp"

namespace trestle::describe {

void Contradictions::add(std::string_view element, std::string_view what, const SaidValue& first,
                         const SaidValue& second) {
  const bool one_file = first.place.file == second.place.file;
  const std::string other = to_string(model_, first.place);
  std::string text = fmt::format("{} has {} {} here, but {}{}{}: make them the same, or {}", element, what,
                                 second.value, first.value, other.empty() ? "" : " at ", other,
                                 one_file ? "take one of them out" : "leave one of the two files out");
  if (told_.insert(to_string(model_, second.place) + text).second) {
    tell_(second.place, std::move(text));
  }
}

}  // namespace trestle::describe
