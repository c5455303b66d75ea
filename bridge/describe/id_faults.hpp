#pragma once
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/describe/member_ids.hpp"
#include "bridge/describe/model.hpp"
#include "bridge/documents/problems.hpp"

/// What is wrong with the ids of a description, told where they stand.
namespace trestle::describe {

/// A member that has an id, and where that stands.
struct IdUse {
  std::string member;
  someip::MethodId id{};
  Place place{};
};

/// Ids that the specification keeps for itself: an error where nothing could be carried under them, else a
/// warning, as real files have them.  [feat_req_someipids_505] [feat_req_someipids_555]
/// [feat_req_someipids_636]
void tell_reserved_service(std::string_view service, someip::ServiceId id, const Place& place,
                           documents::Problems& problems);
/// The same of members of a service that have ids of one sort.
void tell_reserved_members(std::string_view service, const std::vector<IdUse>& uses, IdSort sort,
                           documents::Problems& problems);

class IdFaults {
 public:
  IdFaults(const Model& model, documents::Problems& problems) : model_{model}, problems_{problems} {}

  /// Errors: two members of a service that have one id. What a client calls and what it is sent are told
  /// apart by the message type: a method and an event may share an id, as those of CommonAPI's own tests do.
  /// Where an id stands once for a service and another one that extends it, it is told once.
  void tell_same(const Service& service);
  /// Ids of the service, its eventgroups and its members that the specification keeps for itself.
  void tell_reserved(const Service& service);

 private:
  using Uses = std::vector<IdUse>;
  static Uses uses_of(const Service& service, IdSort sort);
  void tell_same(const Service& service, const Uses& uses);

  const Model& model_;
  documents::Problems& problems_;
  using Spot = std::tuple<std::uint32_t, int, int>;
  static Spot spot_of(const Place& place) { return {place.file, place.mark.line, place.mark.column}; }
  std::set<std::pair<Spot, Spot>> told_{};
};

}  // namespace trestle::describe
