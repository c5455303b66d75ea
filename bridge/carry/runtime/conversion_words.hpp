#pragma once
#include <string>

#include "bridge/messages/convert/conversion_plan.hpp"
#include "someip/wire/payload_rules.hpp"

namespace trestle::carry {

/// Why a message was refused, for the log: with the bytes that stand where the converter stopped.
[[nodiscard]] std::string in_words(const messages::ConversionError& error, ByteView input);
/// The same of a SOME/IP payload, with a guess at the rule of `wire` that its sender has, where one is
/// likely.
[[nodiscard]] std::string in_words(const messages::ConversionError& error, ByteView payload,
                                   const someip::PayloadRules& rules);

}  // namespace trestle::carry
