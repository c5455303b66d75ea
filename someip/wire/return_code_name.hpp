#pragma once
#include <string_view>

#include "someip/wire/header.hpp"

namespace trestle::someip {

/// "E_OK"; empty for a code that is left to applications or reserved.  [feat_req_someip_371]
[[nodiscard]] std::string_view name_of(ReturnCode code) noexcept;

}  // namespace trestle::someip
