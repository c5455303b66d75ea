#pragma once
#include "sd/net/node_config.hpp"
#include "sd/net/service_spec.hpp"

namespace trestle::sd {

// Checks of what callers pass. Each throws std::invalid_argument, whose what() names the field, or does
// nothing.

void check(const NodeConfig& config);
/// @param field  the name of `pacing` where it stands.
void check(const someip::TpPacing& pacing, const char* field);
void check(const CallSpec& spec);

/// What is wrong with a description by itself, to be written after the name of the field; empty if nothing is
/// wrong.
[[nodiscard]] std::string mistake_in(const someip::AnswerRules& rules);
[[nodiscard]] std::string mistake_in(const someip::TpPacing& pacing);
[[nodiscard]] std::string mistake_in(const ServiceSpec& spec, const NodeConfig& config);
[[nodiscard]] std::string mistake_in(const RequireSpec& spec, const NodeConfig& config);
[[nodiscard]] std::string mistake_in(const SubscribeSpec& spec, const NodeConfig& config);

/// Whether an eventgroup of the service has this event or notifier.
[[nodiscard]] bool is_in_a_group(const ServiceSpec& spec, someip::MethodId event);

/// What is unusual in it, and perhaps a mistake, one line for each; it works all the same.
[[nodiscard]] std::vector<std::string> doubts_about(const ServiceSpec& spec);

}  // namespace trestle::sd
