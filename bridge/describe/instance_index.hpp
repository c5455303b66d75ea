#pragma once
#include <map>
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

}  // namespace trestle::describe
