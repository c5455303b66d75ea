#pragma once
#include "bridge/describe/model.hpp"
#include "fuzz/mutate/generate.hpp"
#include "fuzz/mutate/typed.hpp"

namespace trestle::conform {

/// How the values of a payload stand in it. Of a payload of which nobody said what is in it: an empty
/// structure.
[[nodiscard]] fuzz::Shape shape_of(const describe::Model& model, const describe::Payload& payload);

/// Adds what a description says of this service: its methods, fields, events, eventgroups, and what they
/// carry. Payloads with end-to-end protection stay unknown: they need their header. Of several versions it is
/// the one with this major version, or else any.
/// @return false: it says nothing of a service with this id.
bool add_described(fuzz::KnownService& service, const describe::Model& model);

}  // namespace trestle::conform
