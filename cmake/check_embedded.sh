#!/bin/bash
# Usage: cmake/check_embedded.sh
# Runs the coding rules for the core, cmake/embedded.clang-tidy, over all its sources; fails on a finding. All sources of a
# library are looked at in one unit, which takes a fifth of the time. CLANG_TIDY and JOBS may be set. What is left out has
# to be told by docs/embedding.md, and nothing may be silenced in the code.
set -euo pipefail
cd "$(dirname "$0")/.."
if grep -rn NOLINT someip/wire someip/core sd/wire sd/core sd/c; then
  echo "error: the core silences clang-tidy there" >&2
  exit 1
fi
deviations=$(sed -n '/^### Deviations/,$p' docs/embedding.md)
for check in $(sed -n 's/^  -\([a-z].*\),$/\1/p' cmake/embedded.clang-tidy); do
  if [[ $deviations != *"\`$check\`"* ]]; then
    echo "error: $check is left out, and docs/embedding.md does not tell why" >&2
    exit 1
  fi
done
units=$(mktemp -d)
trap 'rm -r "$units"' EXIT
for folder in someip/wire someip/core someip/core/e2e sd/wire sd/core sd/core/device sd/c; do
  for file in "$folder"/*.cpp; do
    echo "#include \"$PWD/$file\""
  done > "$units/$(echo $folder | tr / _).cpp"
done
ls "$units"/*.cpp | xargs -P "${JOBS:-$(nproc)}" -n 1 sh -c '
  "${CLANG_TIDY:-clang-tidy}" --quiet --config-file=cmake/embedded.clang-tidy --checks=-bugprone-suspicious-include \
    --header-filter="^$PWD/(someip|sd)/(wire|core|c)/" "$0" -- \
    -std=c++20 -fno-exceptions -fno-rtti -I"$PWD" -I"$PWD/sd/c"'
echo "the core keeps its rules"
