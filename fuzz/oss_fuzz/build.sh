#!/usr/bin/env bash
# What OSS-Fuzz calls to build the targets: those of the core, as its image has no Fast DDS and no current Boost. It sets CC,
# CXX, CXXFLAGS, LIB_FUZZING_ENGINE, SRC, WORK and OUT. By hand, with Clang:
#   SRC=.. WORK=/tmp/work OUT=/tmp/out CXX=clang++ CXXFLAGS=-fsanitize=address LIB_FUZZING_ENGINE=-fsanitize=fuzzer ./build.sh
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$WORK" "$OUT"

cmake -S "$source" -B "$WORK/trestle" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-g1 \
  -DTRESTLE_CORE_ONLY=ON -DTRESTLE_TESTS=OFF -DTRESTLE_FUZZ=ON -DTRESTLE_FUZZ_ENGINE="$LIB_FUZZING_ENGINE"
cmake --build "$WORK/trestle" --target fuzz/all

for program in "$WORK"/trestle/fuzz/fuzz_*; do
  [[ -f $program && -x $program ]] || continue
  name=$(basename "$program")
  name=${name#fuzz_}
  cp "$program" "$OUT/$name"
  if [[ -d $source/fuzz/corpus/$name ]]; then
    (cd "$source/fuzz/corpus/$name" && zip -q -r "$OUT/${name}_seed_corpus.zip" .)
  fi
  if [[ -f $source/fuzz/$name.dict ]]; then
    cp "$source/fuzz/$name.dict" "$OUT/$name.dict"
  fi
done
