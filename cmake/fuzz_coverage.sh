#!/usr/bin/env bash
# fuzz_coverage.sh BUILD_DIR [JOBS]: how much of each parser the corpora of the fuzz targets run, in lines, with nothing added
# to them. Builds the targets with Clang's source coverage in BUILD_DIR. Below it: lines that no corpus runs, in missing.txt.
set -euo pipefail
build=$(realpath -m "$1") jobs=${2:-$(nproc)}
root=$(cd "$(dirname "$0")/.." && pwd)

# What reads foreign bytes. Sources that only write, print or draw are none of it.
parsers=(
  someip/wire sd/wire pcaps
  someip/core/stream_parser.cpp someip/core/tp_reassembler.cpp someip/core/call_table.cpp someip/core/request_check.cpp
  someip/core/e2e
  bridge/documents
  bridge/messages/types/msg_parser.cpp bridge/messages/types/idl_parser.cpp
  bridge/messages/convert/cdr_to_someip.cpp bridge/messages/convert/someip_to_cdr.cpp
  bridge/messages/values/yaml_text.cpp bridge/messages/values/json_text.cpp bridge/messages/values/text_value.cpp
  bridge/messages/values/sample_builder.cpp bridge/messages/values/sample_walk.cpp bridge/messages/values/load_wire.cpp
  bridge/describe/read
  bridge/carry/config
  bridge/conform/profile.cpp bridge/conform/replay
  bridge/web/server.cpp
  bridge/guest/frame.cpp
)

if [[ ! -f $build/build.ninja ]]; then
  (cd "$root" && cmake --preset asan -B "$build" -DTRESTLE_SANITIZE= -DTRESTLE_TESTS=OFF \
    -DCMAKE_CXX_FLAGS="-fprofile-instr-generate -fcoverage-mapping") >"$build.log" 2>&1 || { tail -n 30 "$build.log"; exit 1; }
fi
cmake --build "$build" --target fuzz/all -- -j "$jobs" >"$build.log" 2>&1 || { tail -n 30 "$build.log"; exit 1; }

rm -rf "$build/profiles"
mkdir -p "$build/profiles"
objects=()  # the first without -object
for program in "$build"/fuzz/fuzz_*; do
  [[ -f $program && -x $program ]] || continue
  name=$(basename "$program")
  name=${name#fuzz_}
  corpus=$root/fuzz/corpus/$name
  ((${#objects[@]})) && objects+=(-object)
  objects+=("$program")
  [[ -d $corpus ]] || { echo "no corpus: $name"; continue; }
  LLVM_PROFILE_FILE=$build/profiles/$name.profraw "$program" -runs=0 "$corpus" >"$build/profiles/$name.log" 2>&1 || { tail -n 20 "$build/profiles/$name.log"; exit 1; }
done
llvm=$(dirname "$(realpath "$(command -v clang++)")")
"$llvm/llvm-profdata" merge -sparse "$build"/profiles/*.profraw -o "$build/all.profdata"

# The name of a folder stands for what is in it and below.
files=()
for one in "${parsers[@]}"; do
  while IFS= read -r file; do files+=("$file"); done < <(find "$root/$one" -name '*.cpp' | sort)
done
"$llvm/llvm-cov" export -format=lcov -instr-profile="$build/all.profdata" "${objects[@]}" "${files[@]}" >"$build/all.info"
python3 -B - "$root" "$build/all.info" "$build/missing.txt" <<'PYTHON'
import collections
import pathlib
import sys

root, info, missing = sys.argv[1:]
lines = collections.defaultdict(dict)
for line in pathlib.Path(info).read_text().splitlines():
    if line.startswith("SF:"):
        file = str(pathlib.Path(line[3:]).relative_to(root))
    elif line.startswith("DA:"):
        number, count = line[3:].split(",")[:2]
        lines[file][int(number)] = max(lines[file].get(int(number), 0), int(count))
total = run = 0
with open(missing, "w") as out:
    for file in sorted(lines):
        here = sum(count > 0 for count in lines[file].values())
        total += len(lines[file])
        run += here
        print(f"{100 * here / len(lines[file]):5.1f} % of {len(lines[file]):5}  {file}")
        out.writelines(f"{file}:{number}\n" for number, count in sorted(lines[file].items()) if count == 0)
print(f"{100 * run / max(total, 1):5.1f} % of {total:5}  together")
PYTHON
