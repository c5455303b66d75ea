#pragma once
#include <string>

#include "someip/wire/endpoint.hpp"

namespace trestle::describe {

/// "10.0.0.1", "fe80:0:0:0:0:0:0:1": the grammars of FDEPL and ARXML have no "::".
[[nodiscard]] std::string full_text(const IpAddress& address);

}  // namespace trestle::describe
