#include "sd/net/call_errors.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <string_view>
#include <system_error>

#include "someip/wire/enumerator_name.hpp"
#include "someip/wire/return_code_name.hpp"

namespace trestle {
namespace {

// A std::error_category, because Boost's category has no virtual destructor.
class FaultCategory : public std::error_category {
 public:
  const char* name() const noexcept override { return "trestle.call"; }
  std::string message(int value) const override {
    static constexpr std::array texts{"nobody offers the service",
                                      "no TCP connection to the server",
                                      "the request could not be sent",
                                      "too many calls are outstanding",
                                      "no answer in time",
                                      "the answer is an error"};
    return someip::enumerator_name<sd::CallFault::error>(texts,
                                                         sd::CallFault{static_cast<std::uint8_t>(value - 1)});
  }
};

class ReturnCodeCategory : public std::error_category {
 public:
  const char* name() const noexcept override { return "someip"; }
  std::string message(int value) const override {
    const std::string_view name = someip::name_of(someip::ReturnCode{static_cast<std::uint8_t>(value)});
    if (!name.empty()) {
      return "the answer is " + std::string{name};
    }
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "the answer is error 0x%02x", static_cast<unsigned>(value));
    return text.data();
  }
};

}  // namespace

namespace sd {
// For Boost 0 means success, and CallFault has no value for that.
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
