#include "bridge/describe/system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "bridge/describe/instance_index.hpp"
#include "bridge/describe/join.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe {
namespace {

/// The members of a service that are called or sent over TCP.
std::vector<std::string> over_tcp(const Service& service) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name, bool is_there, const Transfer& transfer) {
    if (is_there && transfer.transport == Transport::tcp && (names.empty() || names.back() != name)) {
      names.push_back(name);
    }
  };
  for (const Event& event : service.events) {
    add(event.name, true, event.transfer);
  }
  for (const Method& method : service.methods) {
    add(method.name, true, method.request_transfer);
  }
  for (const Field& field : service.fields) {
    add(field.name, field.has_getter, field.getter_transfer);
    add(field.name, field.has_setter, field.setter_transfer);
    add(field.name, field.has_notifier, field.notifier_transfer);
  }
  return names;
}

/// Instances that are offered at a UDP port alone, though some of their members go over TCP.
std::vector<documents::Problem> without_tcp_port(const Model& model) {
  documents::Problems problems{documents::Problems::no_limit};
  const InstanceIndex index{model};
  for (const Service& service : model.services) {
    const std::vector<std::string> names = over_tcp(service);
    if (names.empty()) {
      continue;
    }
    for (const Instance* const instance : index.of(service)) {
      if (instance->role == Instance::Role::provided && instance->udp_port && !instance->tcp_port) {
        problems.warning(
            instance->place,
            fmt::format("the instance of {} has no TCP port, which {}{} need{}: expected one, or "
                        "UDP for {}",
                        full_name(service.scope, service.name), names.front(),
                        names.size() > 1 ? fmt::format(" and {} more", names.size() - 1) : "",
                        names.size() > 1 ? "" : "s", names.size() > 1 ? "them" : "it"));
      }
    }
  }
  return problems.take(model.files);
}

}  // namespace

System make_system(Reading reading, IdLock& lock, const SystemOptions& options) {
  System system;
  const bool was_read = reading.ok();
  system.model = std::move(reading.model);
  system.problems = std::move(reading.problems);
  if (!was_read) {
    return system;
  }
  const auto take = [&](std::vector<documents::Problem> problems) {
    system.problems.insert(system.problems.end(), std::make_move_iterator(problems.begin()),
                           std::make_move_iterator(problems.end()));
  };
  Edited edited = apply_edits(options.edits, system.model);
  system.renamed = std::move(edited.renamed);
  take(std::move(edited.problems));
  if (options.allocates) {
    take(allocate_ids(system.model, lock));
  }
  if (!options.edits.empty()) {
    join_again(system.model, system.problems);  // ids that are the same now
  }
  take(without_tcp_port(system.model));
  if (options.lowers) {
    system.lowered = lower(system.model, options.lower);
  }
  system.good = std::ranges::none_of(system.problems, [](const documents::Problem& problem) {
    return problem.severity == documents::Problem::Severity::error;
  });
  return system;
}

}  // namespace trestle::describe
