#pragma once
#include <string>

#include "bridge/cli/options.hpp"
#include "someip/wire/header.hpp"

/// Payloads as the options want them; or why one cannot be printed. On a terminal, long arrays are cut.
namespace trestle::inspect {

/// What is printed of a payload, and what is wrong with it.
struct PayloadText {
  std::string text{};   ///< with its line end; may be empty
  std::string fault{};  ///< why the payload is no message of its type; empty: nothing is wrong
  /// What its end-to-end check found wrong; empty: nothing. After an error its values are not shown.
  std::string failed_check{};
};

/// What a payload says.
///   hex   "0a0b0c"
///   yaml  the values; nothing for an empty payload
///   json  an object: docs/tools.md lists its fields
[[nodiscard]] PayloadText answer_text(const someip::Message& answer, const cli::PayloadOptions& options);

/// A received event or request.
///   hex   "0x8001 0a0b0c", with a description "Door.moved 0a0b0c"
///   yaml  a comment that names event and session, the values, and "---"
///   json  an object: docs/tools.md lists its fields
/// @param from  its sender; null: unknown.
[[nodiscard]] PayloadText message_text(const someip::Message& message, const Endpoint* from,
                                       const cli::PayloadOptions& options);

}  // namespace trestle::inspect
