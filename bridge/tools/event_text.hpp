#pragma once
#include <string>
#include <tl/expected.hpp>

#include "bridge/tools/options.hpp"
#include "someip/wire/header.hpp"

namespace trestle::bridge {

/// A received message as the options want it, with its line ends; or why its payload cannot be printed.
///   hex   "0x8001 0a0b0c"
///   yaml  a comment that names event and session, the values, and "---"
///   json  an object: docs/tools.md lists its fields
/// @param longest  see PrintOptions.
[[nodiscard]] tl::expected<std::string, std::string> message_text(const someip::Message& message,
                                                                  const Endpoint& from,
                                                                  const PayloadOptions& options,
                                                                  std::size_t longest);

}  // namespace trestle::bridge
