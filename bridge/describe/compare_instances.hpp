#pragma once
#include "bridge/describe/change_log.hpp"
#include "bridge/describe/instance_index.hpp"
#include "bridge/describe/model.hpp"

namespace trestle::describe::comparing {

/// Compares who offers and who uses services. A model without any instance does not say it.
class InstanceComparison {
 public:
  /// All of these outlive it.
  InstanceComparison(const Model& before, const Model& after, ChangeLog& log)
      : before_{before}, after_{after}, log_{log}, old_{before}, new_{after} {}

  /// The instances of a service.
  /// @param is_strict  whether what one side alone says is a difference, and so is an instance that one side
  ///                   alone has.
  void compare(const Service& old, const Service& now, bool is_strict);

 private:
  void compare(const Service& service, const Instance& old, const Instance& now, bool is_strict);

  const Model& before_;
  const Model& after_;
  ChangeLog& log_;
  InstanceIndex old_;
  InstanceIndex new_;
};

/// Compares constants: between two languages only the values of those that both have.
void compare_constants(const Model& before, const Model& after, ChangeLog& log);

}  // namespace trestle::describe::comparing
