#pragma once
#include <string>

#include "bridge/describe/model.hpp"

/// What a description says of a service. What it does not say is no difference to another one.
namespace trestle::describe::comparing {

/// "a.b.C" of "/a/b/C".
[[nodiscard]] std::string dotted(std::string name);

/// The name of a service however its language spells the scope: FIDL has packages, ARXML packages or
/// NAMESPACES.
[[nodiscard]] std::string spelled_alike(const Service& service);
[[nodiscard]] bool has_same_name(const Service& old, const Service& now);

/// Most of the members of each are in the other.
[[nodiscard]] bool have_same_members(const Service& old, const Service& now);

/// A route file has the names of ROS, without packages of interfaces.
[[nodiscard]] bool is_of_routes(const Service& service);

/// Has ids alone, as vsomeip JSON and captures do: what it does not say may be so or not.
[[nodiscard]] bool has_ids_alone(const Service& service);

/// Has no id of its own and of no member, as a FIDL file without its FDEPL: how it is carried is open.
[[nodiscard]] bool is_without_ids(const Service& service);

/// Whether the model is what a capture shows: other services may be there too.
[[nodiscard]] bool is_of_capture(const Model& model);
/// What a capture shows stands at no line of a file.
[[nodiscard]] bool is_of_capture(const Service& service);

/// ".fidl": the end of the name of the file; empty: it is in none.
[[nodiscard]] std::string language_of(const Model& model, const Place& place);

/// What a service says that is compared with `other`'s.
struct Said {
  bool ids_alone;
  bool names;
  bool version;
  bool members;      ///< all methods, and all parts of fields, that there are
  bool events;       ///< and all events
  bool eventgroups;  ///< which event is in which
  bool transport;

  Said(const Model& model, const Service& service, const Service& other);
};

/// `service`, which has ids alone, with the methods and events of `other`'s fields as parts of fields.
[[nodiscard]] Service with_fields(const Service& service, const Service& other);

}  // namespace trestle::describe::comparing
