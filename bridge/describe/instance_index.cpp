#include "bridge/describe/instance_index.hpp"

#include <algorithm>
#include <iterator>

namespace trestle::describe {

InstanceIndex::InstanceIndex(const Model& model) {
  for (const Instance& instance : model.instances) {
    if (!instance.service.empty()) {
      named_[instance.service].push_back(&instance);
    } else if (instance.service_id) {
      nameless_[*instance.service_id].push_back(&instance);
    }
  }
  for (const Service& service : model.services) {
    services_.try_emplace(full_name(service.scope, service.name), &service);
    if (service.id) {
      by_id_.try_emplace(*service.id, &service);
    }
  }
}

std::vector<const Instance*> InstanceIndex::of(const Service& service) const {
  std::vector<const Instance*> all;
  if (const auto named = named_.find(full_name(service.scope, service.name)); named != named_.end()) {
    all = named->second;
  }
  if (const auto nameless = service.id ? nameless_.find(*service.id) : nameless_.end();
      nameless != nameless_.end()) {
    const auto middle = static_cast<std::ptrdiff_t>(all.size());
    all.insert(all.end(), nameless->second.begin(), nameless->second.end());
    std::inplace_merge(all.begin(), all.begin() + middle, all.end());
  }
  return all;
}

const Service* InstanceIndex::service_of(const Instance& instance) const {
  if (!instance.service.empty()) {
    return service(instance.service);
  }
  const auto found = instance.service_id ? by_id_.find(*instance.service_id) : by_id_.end();
  return found == by_id_.end() ? nullptr : found->second;
}

const Service* InstanceIndex::service(std::string_view full_name) const {
  const auto found = services_.find(full_name);
  return found == services_.end() ? nullptr : found->second;
}

std::set<std::string, std::less<>> only_bases(const Model& model) {
  std::set<std::string, std::less<>> bases;
  for (const Service& service : model.services) {
    bases.insert(service.base);
  }
  const InstanceIndex index{model};
  std::set<std::string, std::less<>> only;
  for (const Service& service : model.services) {
    std::string name = full_name(service.scope, service.name);
    if (service.id_is_chosen && bases.contains(name) &&
        std::ranges::all_of(index.of(service), &Instance::id_is_chosen)) {
      only.insert(std::move(name));
    }
  }
  return only;
}

}  // namespace trestle::describe
