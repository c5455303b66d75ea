#!/usr/bin/env bash
# package.sh BUILD OUT: Debian packages of a build tree in the folder OUT, with their SBOM. BUILD was made by `./run package`,
# or is any other optimised tree. Twice from the same tree and commit gives the same bytes.
set -euo pipefail
source=$(cd "$(dirname "$0")/.." && pwd)
build=$(cd "$1" && pwd)
mkdir -p "$2"
out=$(cd "$2" && pwd)

version=$(sed -n 's/^project(trestle VERSION \([0-9.]*\).*/\1/p' "$source/CMakeLists.txt")
export SOURCE_DATE_EPOCH TRESTLE_SOURCE=$source TRESTLE_BUILD=$build TRESTLE_VERSION
if git -C "$source" rev-parse -q --verify HEAD >/dev/null 2>&1; then
  SOURCE_DATE_EPOCH=$(git -C "$source" log -1 --format=%ct)
  commit=$(git -C "$source" rev-parse --short=8 HEAD)
  # A tagged commit is a release; all others sort before it, and by their time.
  if [[ $(git -C "$source" tag --points-at HEAD) != *"v$version"* ]]; then
    version+="~git$(date -u -d "@$SOURCE_DATE_EPOCH" +%Y%m%d%H%M).$commit"
    [[ -z $(git -C "$source" status --porcelain --untracked-files=no) ]] || version+=.changed
  fi
else  # an archive of the sources
  SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(stat -c %Y "$source/CMakeLists.txt")}
  commit=$version
fi
TRESTLE_VERSION=$version

pack=$out/pack/trestle
rm -rf "$out/pack" "$out"/*.deb "$out"/*.buildinfo "$out"/*.changes "$out"/*.spdx.json
mkdir -p "$pack"
cp -r "$source/packaging/debian" "$pack/debian"
cat >"$pack/debian/changelog" <<EOF
trestle ($version) unstable; urgency=medium

  * Of commit $commit. /usr/share/doc/trestle/changelog.gz says what changed.

 -- The Trestle authors <maintainers@trestle.example>  $(LC_ALL=C date -u -R -d "@$SOURCE_DATE_EPOCH")
EOF
cd "$pack"
umask 022
dpkg-buildpackage --build=binary --no-sign --no-check-builddeps
mv "$out"/pack/*.deb "$out"/pack/*.buildinfo "$out"/pack/*.changes "$out/"
cp trestle.spdx.json "$out/trestle_$version.spdx.json"
rm -rf "$out/pack"
