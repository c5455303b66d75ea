#include "someip/wire/return_code_name.hpp"

#include <array>

namespace trestle::someip {

std::string_view name_of(ReturnCode code) noexcept {
  // Names up to E_WRONG_MESSAGE_TYPE are from the Open SOME/IP Specification, later ones from AUTOSAR.
  constexpr std::array<std::string_view, 16> names{"E_OK",
                                                   "E_NOT_OK",
                                                   "E_UNKNOWN_SERVICE",
                                                   "E_UNKNOWN_METHOD",
                                                   "E_NOT_READY",
                                                   "E_NOT_REACHABLE",
                                                   "E_TIMEOUT",
                                                   "E_WRONG_PROTOCOL_VERSION",
                                                   "E_WRONG_INTERFACE_VERSION",
                                                   "E_MALFORMED_MESSAGE",
                                                   "E_WRONG_MESSAGE_TYPE",
                                                   "E_E2E_REPEATED",
                                                   "E_E2E_WRONG_SEQUENCE",
                                                   "E_E2E",
                                                   "E_E2E_NOT_AVAILABLE",
                                                   "E_E2E_NO_NEW_DATA"};
  const auto number = static_cast<std::size_t>(code);
  return number < names.size() ? names[number] : std::string_view{};
}

}  // namespace trestle::someip
