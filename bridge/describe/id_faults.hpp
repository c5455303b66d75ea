#pragma once
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/documents/problems.hpp"

/// What is wrong with the ids of a description, told where they stand.
namespace trestle::describe {

class IdFaults {
 public:
  IdFaults(const Model& model, documents::Problems& problems) : model_{model}, problems_{problems} {}

  /// Errors: two members of a service that have one id. What a client calls and what it is sent are told
  /// apart by the message type: a method and an event may share an id, as those of CommonAPI's own tests do.
  /// Where an id stands once for a service and another one that extends it, it is told once.
  void tell_same(const Service& service);
  /// Ids that the specification keeps for itself: an error where nothing could be carried under them, else a
  /// warning, as real files have them.  [feat_req_someipids_505] [feat_req_someipids_555]
  /// [feat_req_someipids_636]
  void tell_reserved(const Service& service);

 private:
  struct Use {
    std::string member;
    someip::MethodId id{};
    const Place* place = nullptr;
  };
  using Uses = std::vector<Use>;
  static Uses called(const Service& service);
  static Uses sent(const Service& service);
  void tell_same(const Service& service, const Uses& uses);
  void tell_reserved(const Service& service, const Uses& uses, bool are_events);

  const Model& model_;
  documents::Problems& problems_;
  using Spot = std::tuple<std::uint32_t, int, int>;
  static Spot spot_of(const Place& place) { return {place.file, place.mark.line, place.mark.column}; }
  std::set<std::pair<Spot, Spot>> told_{};
};

}  // namespace trestle::describe
