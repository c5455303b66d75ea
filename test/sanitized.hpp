#pragma once

namespace trestle::test {

/// Whether this is built with Clang's address or thread sanitizer: freed memory is kept for a while, all
/// memory has shadows that take pages of their own, and none of it runs with little memory.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TRESTLE_TEST_IS_SANITIZED
#endif
#endif
#ifdef TRESTLE_TEST_IS_SANITIZED
inline constexpr bool sanitized = true;
#undef TRESTLE_TEST_IS_SANITIZED
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace trestle::test
