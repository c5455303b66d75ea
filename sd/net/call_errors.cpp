#include "sd/net/call_errors.hpp"

#include <array>
#include <string>
#include <system_error>

namespace trestle {
namespace {

// Of std, since those of Boost have no virtual destructor.
class FaultCategory : public std::error_category {
 public:
  const char* name() const noexcept override { return "trestle.call"; }
  std::string message(int value) const override {
    using sd::CallFault;
    switch (CallFault{static_cast<std::uint8_t>(value - 1)}) {
      case CallFault::unavailable:
        return "nobody offers the service";
      case CallFault::not_connected:
        return "no TCP connection to the server";
      case CallFault::not_sent:
        return "the request could not be sent";
      case CallFault::too_many_calls:
        return "too many calls are outstanding";
      case CallFault::timed_out:
        return "no answer in time";
      case CallFault::error:
        return "the answer is an error";
    }
    return "unknown";
  }
};

class ReturnCodeCategory : public std::error_category {
 public:
  const char* name() const noexcept override { return "someip"; }
  std::string message(int value) const override {
    // Up to E_WRONG_MESSAGE_TYPE the Open SOME/IP Specification's, then AUTOSAR's for the same protocol.
    constexpr std::array<const char*, 16> names{"E_OK",
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
    const auto code = static_cast<std::size_t>(value);
    return "the answer is " + (code < names.size() ? names[code] : "error " + std::to_string(value));
  }
};

}  // namespace

namespace sd {
// Boost takes 0 for success, which CallFault has not.
boost::system::error_code make_error_code(CallFault fault) noexcept {
  static const FaultCategory category;
  return std::error_code{static_cast<int>(fault) + 1, category};
}
}  // namespace sd

namespace someip {
boost::system::error_code make_error_code(ReturnCode code) noexcept {
  static const ReturnCodeCategory category;
  return std::error_code{static_cast<int>(code), category};
}
}  // namespace someip

}  // namespace trestle
