#include "bridge/describe/contradictions.hpp"

#include <fmt/format.h>

#include "bridge/describe/join.hpp"

namespace trestle::describe {

Contradictions::Contradictions(const Model& model, Tell tell, Tell warn)
    : model_{model}, tell_{std::move(tell)}, warn_{std::move(warn)} {
  for (const Instance& instance : model.instances) {
    if (instance.observed_ttl_s) {
      captures_.insert(instance.place.file);
    }
  }
}

void Contradictions::add(std::string_view element, std::string_view what, const SaidValue& first,
                         const SaidValue& second) {
  const bool one_file = first.place.file == second.place.file;
  const std::string other = to_string(model_, first.place);
  std::string text = fmt::format("{} has {} {} here, but {}{}{}: make them the same, or {}", element, what,
                                 second.value, first.value, other.empty() ? "" : " at ", other,
                                 one_file ? "take one of them out" : "leave one of the two files out");
  tell_once(tell_, second.place, std::move(text));
}

bool Contradictions::settle(std::string_view element, std::string_view what, const SaidValue& first,
                            const SaidValue& second) {
  const Origin known = origin_of(first.place);
  const Origin other = origin_of(second.place);
  if (known == other) {
    add(element, what, first, second);
    return false;
  }
  const bool second_holds = other > known;
  const bool has_configuration = known == Origin::configuration || other == Origin::configuration;
  tell_once(
      warn_, second.place,
      fmt::format("{} has {} {} here, but {} at {}: {}, {}, is taken", element, what, second.value,
                  first.value, to_string(model_, first.place), second_holds ? second.value : first.value,
                  has_configuration ? "of the configuration of vsomeip" : "which was seen on the network"));
  return second_holds;
}

void Contradictions::warn_of_two_hosts(std::string_view element, const SaidValue& first,
                                       const SaidValue& second) {
  tell_once(warn_, second.place,
            fmt::format("{} is listed by two hosts, {} here and {} at {}: both are taken for servers of it; "
                        "leave out the file of the one that is not",
                        element, second.value, first.value, to_string(model_, first.place)));
}

bool Contradictions::is_configuration(const Place& place) const {
  return model_.configurations.contains(place.file);
}

Contradictions::Origin Contradictions::origin_of(const Place& place) const {
  return is_configuration(place)          ? Origin::configuration
         : captures_.contains(place.file) ? Origin::capture
                                          : Origin::description;
}

void Contradictions::tell_once(const Tell& tell, const Place& place, std::string text) {
  if (told_.insert(to_string(model_, place) + text).second) {
    tell(place, std::move(text));
  }
}

}  // namespace trestle::describe
