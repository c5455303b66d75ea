#pragma once
#include <cstdint>
#include <functional>
#include <span>

#include "bridge/describe/contradictions.hpp"
#include "bridge/describe/model.hpp"

/// How what one source knows of an instance is put into what another one knows, for join() and readers.
namespace trestle::describe {

/// Adds what `from` says and `to` does not. Where both say something else, `to` stays as it is, unless `from`
/// is a configuration of vsomeip and `to` is not, and this is told of a provided instance; of a required one
/// several clients may have settings of their own.
void add_instance(Instance& to, const Instance& from, Contradictions& contradictions);

/// Tells of instances that are at several addresses for no reason: one host may have several, and so may
/// several hosts, but two descriptions of one instance that know of no hosts contradict each other.
/// Where one of the two is a configuration of vsomeip, both are at its address afterwards.
/// @param major_of  the major version of an instance.
void tell_of_addresses(std::span<Instance> instances,
                       const std::function<std::uint8_t(const Instance&)>& major_of,
                       Contradictions& contradictions);

}  // namespace trestle::describe
