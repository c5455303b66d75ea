# What the core, and its tests, need of the building machine when they are built for another one: headers and sources
# that suit every target. Taken one folder at a time, for /usr/include as a whole is of the building machine.

include(TrestleHeaders)
trestle_headers(tl::expected tl/expected.hpp)

if(TRESTLE_TESTS)
  trestle_headers(fmt::fmt fmt/format.h)
  target_compile_definitions(fmt::fmt INTERFACE FMT_HEADER_ONLY)
  # Compiled from Debian's sources of it: its own CMakeLists.txt looks for threads, and wants a C compiler.
  set(gtest /usr/src/googletest)
  add_library(trestle_gtest STATIC EXCLUDE_FROM_ALL ${gtest}/googletest/src/gtest-all.cc
    ${gtest}/googlemock/src/gmock-all.cc ${gtest}/googlemock/src/gmock_main.cc)
  target_include_directories(trestle_gtest SYSTEM PUBLIC ${gtest}/googletest/include ${gtest}/googlemock/include
    PRIVATE ${gtest}/googletest ${gtest}/googlemock)
  foreach(name IN ITEMS gmock gtest gtest_main)
    add_library(GTest::${name} ALIAS trestle_gtest)
  endforeach()
endif()

if(TRESTLE_TESTS AND CMAKE_SYSTEM_NAME STREQUAL Generic)
  # Tests want a C library: newlib, and semihosting for its input and output.
  set(board ${PROJECT_SOURCE_DIR}/examples/cortex_m/board)
  add_library(trestle_test_board OBJECT ${board}/startup.cpp ${PROJECT_SOURCE_DIR}/test/cortex_m.cpp)
  target_include_directories(trestle_test_board PUBLIC ${PROJECT_SOURCE_DIR} PRIVATE ${PROJECT_SOURCE_DIR}/examples/cortex_m)
  target_link_options(trestle_test_board INTERFACE -nostartfiles --specs=rdimon.specs -L${board} -T mps2_an385_psram.ld)
  set(CMAKE_CROSSCOMPILING_EMULATOR qemu-system-arm -M mps2-an385 -display none -monitor none -serial none
    -semihosting-config enable=on,target=native -kernel)
  # newlib shows what is not of ISO C++ only on demand; and GoogleTest is not to look for what there is none of.
  target_compile_definitions(trestle_gtest PUBLIC _GNU_SOURCE GTEST_HAS_PTHREAD=0 GTEST_HAS_POSIX_RE=0
    GTEST_HAS_STREAM_REDIRECTION=0 PRIVATE PATH_MAX=1024)
endif()
