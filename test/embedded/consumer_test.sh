#!/usr/bin/env bash
# consumer_test.sh BUILD_DIR SOURCE_DIR WORK_DIR: a project for a microcontroller finds Trestle, as a folder and as installed.
set -euo pipefail
build=$1 source=$2 work=$3
rm -rf "$work"
cmake --install "$build" --prefix "$work/prefix" >/dev/null
for place in "-DTRESTLE_FOLDER=$source" "-DCMAKE_PREFIX_PATH=$work/prefix"; do
  cmake -S "$source/test/embedded/consumer" -B "$work/build" --fresh -G Ninja -DCMAKE_BUILD_TYPE=MinSizeRel \
    -DCMAKE_TOOLCHAIN_FILE="$source/cmake/toolchains/cortex-m3.cmake" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "$place"
  cmake --build "$work/build" --target firmware
  if grep -n -- '-isystem /usr/include' "$work/build/build.ninja"; then
    echo "headers of the building machine are used for another one" >&2
    exit 1
  fi
done
