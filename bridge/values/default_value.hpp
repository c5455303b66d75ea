#pragma once
#include "bridge/types/message_definition.hpp"
#include "bridge/values/text_value.hpp"

namespace trestle::bridge {

/// The default value of a field that has one, which the parser of .msg files has checked.
[[nodiscard]] TextValue default_value(const Field& field);

}  // namespace trestle::bridge
