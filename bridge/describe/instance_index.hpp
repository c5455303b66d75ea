#pragma once
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// Which instances are of which service: what is_of() tells of a pair, for a whole model at once. Points into
/// the model, and knows it as it was.
class InstanceIndex {
 public:
  explicit InstanceIndex(const Model& model);

  /// In the order of the model.
  [[nodiscard]] std::vector<const Instance*> of(const Service& service) const;
  /// The first service that an instance is of; null: none.
  [[nodiscard]] const Service* service_of(const Instance& instance) const;
  /// The service of this full name, as Model::service().
  [[nodiscard]] const Service* service(std::string_view full_name) const;

 private:
  std::map<std::string, std::vector<const Instance*>, std::less<>> named_;
  std::map<someip::ServiceId, std::vector<const Instance*>> nameless_;
  std::map<std::string, const Service*, std::less<>> services_;
  std::map<someip::ServiceId, const Service*> by_id_;
};

/// Full names of services that only others extend: no description gives them an id or an instance, so that
/// nobody offers them. For models in which ids are chosen.
[[nodiscard]] std::set<std::string, std::less<>> only_bases(const Model& model);

}  // namespace trestle::describe
