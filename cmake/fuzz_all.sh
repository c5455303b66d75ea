#!/usr/bin/env bash
# fuzz_all.sh BUILD_DIR SECONDS JOBS: runs every fuzz target for SECONDS from its committed corpus and the seeds
# that were cut from the captures; new inputs stay in the build directory.
set -euo pipefail
build=$1 seconds=$2 jobs=$3
root=$(cd "$(dirname "$0")/.." && pwd)

run_one() {
  local build=$1 seconds=$2 root=$3 target=$4 name corpus found log
  name=$(basename "$target")
  name=${name#fuzz_}
  found=$build/corpus/$name
  log=$build/$name.log
  mkdir -p "$found" "$build/seeds/$name"
  corpus=("$found" "$build/seeds/$name")
  [[ -d $root/fuzz/corpus/$name ]] && corpus+=("$root/fuzz/corpus/$name")
  local options=(-max_total_time="$seconds" -timeout=10 -rss_limit_mb=3000 -print_final_stats=1 -artifact_prefix="$build/crash-$name-")
  [[ -f $root/fuzz/$name.dict ]] && options+=(-dict="$root/fuzz/$name.dict")
  if ! "$target" "${options[@]}" "${corpus[@]}" >"$log" 2>&1; then
    tail -n 60 "$log"
    echo "fuzz target $name failed; reproduce with: $target $build/crash-$name-*"
    return 1
  fi
  printf '    fuzz %-16s %9s runs, %s\n' "$name" "$(sed -n 's/stat::number_of_executed_units: *//p' "$log")" \
    "$(grep -oE 'cov: [0-9]+' "$log" | tail -n 1)"
}
export -f run_one

targets=("$build"/fuzz/fuzz_*)
[[ -x ${targets[0]} ]] || { echo "no fuzz targets in $build/fuzz" >&2; exit 1; }
"$build/fuzz/cut_seeds" "$root/pcaps" "$build/seeds"
printf '%s\0' "${targets[@]}" | grep -zv '\.' | xargs -0 -P "$jobs" -I{} bash -c 'run_one "$@"' run_one "$build" "$seconds" "$root" {}
