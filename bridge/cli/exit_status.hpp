#pragma once

/// What the `trestle` program tells its caller. Every command keeps to these.
namespace trestle::cli {

inline constexpr int exit_ok = 0;
inline constexpr int exit_failure = 1;  ///< the command ran and what it did failed
inline constexpr int exit_usage = 2;    ///< the command line or the configuration is wrong: nothing was done
inline constexpr int exit_error_answer = 3;  ///< `trestle call` was answered with an error

}  // namespace trestle::cli
