#pragma once
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "bridge/picture/picture.hpp"

namespace trestle::carry {

/// What interface descriptions call the ids of services, so that pictures of routes have the names.
class IdNames {
 public:
  /// The names of one version of a service.
  struct Service {
    std::string name;                                  ///< as its description writes it
    std::map<std::uint16_t, std::string> members;      ///< methods, events and parts of fields: "opening.get"
    std::map<std::uint16_t, std::string> eventgroups;  ///< or what is in them, "moved, level"
    bool id_is_chosen = false;                         ///< the description does not give it
    std::set<std::uint16_t> chosen_members{};          ///< whose ids it does not give
    std::set<std::uint16_t> chosen_eventgroups{};
  };

  /// Of several with the same id and major version the first one is kept.
  void add(std::uint16_t id, std::uint32_t major, Service service);
  /// Fills in the names of a route. What nobody has described stays as it is.
  void name(RoutePicture& route) const;
  /// "Seat.moved" of a method, event or part of a field; empty: nobody has described it.
  [[nodiscard]] std::string member(std::uint16_t service, std::uint32_t major, std::uint16_t id) const;
  /// What one of the versions of a service is called; empty: nobody has described it.
  [[nodiscard]] std::string service(std::uint16_t id) const;
  /// The same of an eventgroup.
  [[nodiscard]] std::string eventgroup(std::uint16_t service, std::uint16_t id) const;
  [[nodiscard]] bool empty() const noexcept { return services_.empty(); }

 private:
  [[nodiscard]] const Service* any_version(std::uint16_t id) const;

  std::map<std::pair<std::uint16_t, std::uint32_t>, Service> services_;  ///< by id and major version
};

}  // namespace trestle::carry
