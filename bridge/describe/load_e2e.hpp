#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "bridge/describe/e2e_settings.hpp"
#include "bridge/describe/model.hpp"
#include "bridge/documents/section.hpp"

/// End-to-end protection as a Node takes it: from configurations and from interface descriptions.
namespace trestle::describe {

/// Reads the keys of `e2e`: docs/configuration.md.
/// @param is_method  it may have a profile that tells requests from answers.
/// @param refused  called for each given key that only receivers have; reports it if it is not allowed.
[[nodiscard]] std::optional<E2eSettings> load_e2e(documents::Section& section, bool is_method,
                                                  const std::function<void(const char*)>& refused,
                                                  documents::Problems& problems);

/// What is protected, seen from us.
enum class E2eUse : std::uint8_t { sent_event, received_event, served, called };

/// The keys of `e2e` for what a description says. Parameters that the profile or the use does not have are
/// left out: descriptions may have them for other profiles.
[[nodiscard]] YAML::Node e2e_yaml(const Protection& e2e, E2eUse use);

/// What a description says, for a Node.
/// @return or why that cannot be: "data_bits: missing, expected …".
[[nodiscard]] tl::expected<E2eSettings, std::string> e2e_settings(const Protection& e2e, E2eUse use);

/// Why a Node cannot do what a description says; empty: it can, or there is no protection.
[[nodiscard]] std::string e2e_fault(const Protection& e2e, E2eUse use);

/// What of a protection decides about the bytes of messages. What only says what a receiver accepts is not in
/// it.
struct WireSettings {
  /// One name for profiles with the same bytes: "1" for 11, "2" for 22, "4" for 44, "4m" for 44m; empty:
  /// none.
  std::string profile{};
  /// Parameters of the profile by their names, in one spelling; those with a default also where nobody gave
  /// them.
  std::map<std::string, std::string, std::less<>> values{};
};
[[nodiscard]] WireSettings wire_settings(const Protection& e2e);

}  // namespace trestle::describe
