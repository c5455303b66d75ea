#pragma once
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/values/text_value.hpp"

namespace trestle::messages {

/// The default value of a field that has one, which the parser of .msg files has checked.
[[nodiscard]] TextValue default_value(const Field& field);

}  // namespace trestle::messages
