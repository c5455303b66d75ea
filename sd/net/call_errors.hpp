#pragma once
#include <boost/system/error_code.hpp>

#include "sd/net/service_spec.hpp"

/// Why a Proxy's call has no response, as the error codes that Asio passes on: `error ==
/// CallFault::timed_out`, `error == ReturnCode::not_ready`. A server's error is its ReturnCode.
namespace boost::system {
template <>
struct is_error_code_enum<trestle::sd::CallFault> : std::true_type {};
template <>
struct is_error_code_enum<trestle::someip::ReturnCode> : std::true_type {};
}  // namespace boost::system

namespace trestle::sd {
[[nodiscard]] boost::system::error_code make_error_code(CallFault fault) noexcept;
}

namespace trestle::someip {
/// ReturnCode::ok is no error.
[[nodiscard]] boost::system::error_code make_error_code(ReturnCode code) noexcept;
}  // namespace trestle::someip
