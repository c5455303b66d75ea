#!/usr/bin/env bash
# install_test.sh BUILD_DIR SOURCE_DIR WORK_DIR CXX: what `cmake --install` puts down can be found, linked and run.
set -euo pipefail
build=$1 source=$2 work=$3 cxx=$4
rm -rf "$work"
cmake --install "$build" --prefix "$work/prefix" >"$work.log"
"$work/prefix/bin/trestle" --version
cmake -S "$source/test/install/consumer" -B "$work/consumer" -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -G Ninja >>"$work.log"
cmake --build "$work/consumer"
out=$("$work/consumer/consumer")
echo "$out"
[[ $out == "16 bytes; missing.yaml: error: "* ]]
# Where the folder's name begins a path: it may be the name of one of ours, too.
if grep -rlP "(?<![\\w}/.-])\\Q$source\\E" "$work/prefix/lib" --include='*.cmake'; then
  echo "the installed package names folders of the build machine" >&2
  exit 1
fi
