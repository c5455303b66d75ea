#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

/// Ids for what a description leaves without: chosen once, the same on each machine, and kept.
namespace trestle::describe {

/// Ids by the names of elements.
using IdsByName = std::map<std::string, std::uint16_t, std::less<>>;

/// Ids of one service that were chosen before.
struct LockedIds {
  std::optional<std::uint16_t> service{};
  /// Full name of the service that it extends: what is new there must not get an id that stands here.
  std::string base{};
  IdsByName methods{};  ///< also those of getters and setters: "label/getter", "label/setter"
  IdsByName events{};   ///< also those of notifiers: "label/notifier"
};

/// Ids that were chosen before. An id stays here when its element is gone, so that no other one gets it.
struct IdLock {
  std::map<std::string, LockedIds, std::less<>> services{};  ///< by full_name()
};

/// Reads the text of a lock file.
/// @param problems  gets what is wrong, with line and column: two elements with one id, as a merge of two
///                  branches can make them, and ids that are reserved, too.
/// @return nothing, where that is an error
[[nodiscard]] std::optional<IdLock> read_id_lock(const std::string& file, const std::string& text,
                                                 std::vector<documents::Problem>& problems);
/// The text of a lock file: YAML, sorted.
[[nodiscard]] std::string to_text(const IdLock& lock);

/// Where ids of services are taken from. Both ends are included.
struct IdRange {
  std::uint16_t first = 0x4000;
  std::uint16_t last = 0x7fff;
};

/// Gives an id to each service, method, event and part of a field without one, an eventgroup to each event
/// and notifier without one, and a provided instance with id 1 to each service that has no instance.
///
/// A service's id follows from its name, so that other services do not change it. Members get the lowest free
/// number, in their order. What is in the lock keeps its id, and what is new is added there. An id that the
/// model has wins over the lock, with a warning. The model tells which ids were chosen: Service::chosen_ids
/// and others.
///
/// An event without an eventgroup joins the lowest one of its service, with a warning where somebody has
/// given ids or eventgroups.
///
/// What a service has of the one that it extends has the id and the eventgroups that it has there, as FDEPL
/// says them once. So a new member of that one gets an id that is free in all services that extend it, those
/// that only the lock knows included.
/// @return what cannot be done: no id is left; and what is chosen though it may surprise, as a warning
[[nodiscard]] std::vector<documents::Problem> allocate_ids(Model& model, IdLock& lock, IdRange services = {});

}  // namespace trestle::describe
