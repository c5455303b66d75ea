#pragma once
#include "bridge/messages/convert/program/program.hpp"

namespace trestle::messages {

/// Finds what may have a Shape, the message and elements of arrays: what begins with several operations whose
/// results depend on nothing but their own bytes and where these stand in CDR.
void find_stretches(Program& program);

}  // namespace trestle::messages
