#pragma once
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/describe/interfaces.hpp"
#include "sd/net/service_spec.hpp"

/// End-to-end protection as interface descriptions have it, for what commands give a Node. What cannot be
/// done is a warning on standard error, also with --quiet: the messages then go without it. So is that
/// instances have different ones, where no instance is named.
namespace trestle::cli {

/// Of a method that is called.
/// @param answered  false: no answer is checked.
[[nodiscard]] std::vector<sd::E2eSpec> protection_of_call(const describe::Interfaces& interfaces,
                                                          const describe::ServiceElement& method,
                                                          someip::InstanceId instance, bool answered);
/// The same for a protection alone, without a warning.
/// @return or why it cannot be done.
[[nodiscard]] tl::expected<sd::E2eSpec, std::string> protection_of_call(const describe::Protection& e2e,
                                                                        someip::MethodId method,
                                                                        bool answered);
/// Of those events of a subscription that a description knows. Also what fails its check is handed over.
/// @param major  of the service, by the description.
[[nodiscard]] std::vector<sd::E2eSpec> protection_of_events(const describe::Interfaces& interfaces,
                                                            const sd::SubscribeSpec& subscription,
                                                            std::uint8_t major);
/// Of all events and methods of an offered service, or of one alone. Also requests that fail their check are
/// handed over.
[[nodiscard]] std::vector<sd::E2eSpec> protection_of_service(
    const describe::Interfaces& interfaces, const sd::ServiceSpec& service,
    std::optional<someip::MethodId> only = std::nullopt);

/// Why a payload cannot be sent with this protection: the profile has no messages of its length.
/// @param what  the event or method, for the text.
/// @return empty: it can.
[[nodiscard]] std::string misfit_of_protection(const sd::E2eSpec& e2e, const std::string& what,
                                               ByteView payload);

/// What a check found wrong: "the E2E check of Door.moved failed: crc". Empty: nothing.
/// @param what  the event, request or answer.
[[nodiscard]] std::string failed_check(const someip::e2e::CheckResult& check, const std::string& what);

}  // namespace trestle::cli
