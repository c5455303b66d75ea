#!/usr/bin/env bash
# fuzz_all.sh BUILD_DIR SECONDS JOBS: runs every fuzz target for SECONDS from its committed corpus and the seeds
# that are cut from the captures, also from those beside the repository; new inputs stay in the build directory.
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

targets=()
for program in "$build"/fuzz/fuzz_*; do
  [[ -f $program && -x $program ]] && targets+=("$program")
done
((${#targets[@]})) || { echo "no fuzz targets in $build/fuzz" >&2; exit 1; }
captures=("$root/pcaps")
[[ -d $root/../shared/pcaps/public ]] && captures+=("$root/../shared/pcaps/public")
"$build/fuzz/cut_seeds" "$build/seeds" "${captures[@]}"
printf '%s\0' "${targets[@]}" | xargs -0 -P "$jobs" -I{} bash -c 'run_one "$@"' run_one "$build" "$seconds" "$root" {}
