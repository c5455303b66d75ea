#pragma once
#include <string>
#include <tl/expected.hpp>

#include "bridge/cli/options.hpp"
#include "someip/wire/header.hpp"

/// Payloads as the options want them; or why one cannot be printed. On a terminal, long arrays are cut.
namespace trestle::inspect {

/// What a payload says, with its line end.
///   hex   "0a0b0c"
///   yaml  the values; nothing for an empty payload
///   json  an object: docs/tools.md lists its fields
[[nodiscard]] tl::expected<std::string, std::string> answer_text(const someip::Message& answer,
                                                                 const cli::PayloadOptions& options);

/// A received event or request.
///   hex   "0x8001 0a0b0c"
///   yaml  a comment that names event and session, the values, and "---"
///   json  an object: docs/tools.md lists its fields
/// @param from  its sender; null: unknown.
[[nodiscard]] tl::expected<std::string, std::string> message_text(const someip::Message& message,
                                                                  const Endpoint* from,
                                                                  const cli::PayloadOptions& options);

}  // namespace trestle::inspect
