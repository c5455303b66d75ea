#!/usr/bin/env bash
# consumer_test.sh BUILD_DIR SOURCE_DIR WORK_DIR: a project for a microcontroller finds Trestle, as a folder and as installed.
set -euo pipefail
build=$1 source=$2 work=$3
rm -rf "$work"
cmake --install "$build" --prefix "$work/prefix" >/dev/null
configure() {
  cmake -S "$source/$1" -B "$work/build" --fresh -G Ninja -DCMAKE_BUILD_TYPE=MinSizeRel -DCMAKE_CXX_COMPILER_LAUNCHER=ccache \
    -DCMAKE_TOOLCHAIN_FILE="$source/cmake/toolchains/cortex-m3.cmake" "$2"
}
for place in "-DTRESTLE_FOLDER=$source" "-DCMAKE_PREFIX_PATH=$work/prefix"; do
  configure test/embedded/consumer "$place"
  cmake --build "$work/build" --target firmware
  if grep -n -- '-isystem /usr/include' "$work/build/build.ninja"; then
    echo "headers of the building machine are used for another one" >&2
    exit 1
  fi
done
# And a whole firmware, by the project that stands beside it.
configure examples/cortex_m "-DCMAKE_PREFIX_PATH=$work/prefix"
cmake --build "$work/build" --target cortex_m_device cortex_m_ets_device
