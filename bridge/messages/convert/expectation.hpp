#pragma once
#include <string>

#include "bridge/messages/convert/conversion_plan.hpp"

namespace trestle::messages {

/// What a converter wanted where it stopped: "4 bytes wanted, 0 left".
/// @param op    of the program, at fault; none of its operations: the message as a whole.
/// @param rest  of the input, from the item at fault to where it would have to end.
[[nodiscard]] std::string expectation(const Program& program, ConversionFault fault, std::size_t op,
                                      bool to_cdr, ByteView rest);

}  // namespace trestle::messages
