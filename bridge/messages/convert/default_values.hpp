#pragma once
#include "bridge/messages/convert/program/program.hpp"

namespace trestle::messages {

/// The default of a field that has one, which the parser of .msg files has checked.
[[nodiscard]] DefaultValue default_value_of(const Field& field);

}  // namespace trestle::messages
