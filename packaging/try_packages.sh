#!/usr/bin/env bash
# try_packages.sh PACKAGES: installs, upgrades, uses and purges the packages of a folder in a Debian of its own, without a
# compiler: build/package_root, or PACKAGE_ROOT. Needs root, and a mirror of Debian (DEBIAN_MIRROR).
set -euo pipefail
cd "$(dirname "$0")/.."
packages=$(cd "$1" && pwd)
root=${PACKAGE_ROOT:-$PWD/build/package_root}
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
die() { echo "error: $*" >&2; exit 1; }
[[ $(id -u) == 0 ]] || die "this makes a root file system and changes into it: run it as root"
if [[ ! -e $root ]]; then
  command -v debootstrap >/dev/null || die "there is no debootstrap, which makes a Debian in a folder"
  mkdir -p "$(dirname "$root")"
  rm -rf "$root.new"
  debootstrap --variant=minbase --include=man-db,bash-completion,procps "$suite" "$root.new" \
    "${DEBIAN_MIRROR:-http://deb.debian.org/debian}" >"$root.log" 2>&1 ||
    { tail -n 5 "$root.log" >&2; die "no Debian could be made; the whole log is $root.log"; }
  mv "$root.new" "$root"
fi
cp /etc/resolv.conf "$root/etc/resolv.conf"
rm -rf "$root/packages"
mkdir -p "$root/packages/newer"
cp "$packages"/*.deb "$root/packages/"
# The same as a later version, to upgrade to.
[[ $(echo "$packages"/trestle_*.deb | wc -w) == 1 ]] || die "$packages has more than one version"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
dpkg-deb --raw-extract "$packages"/trestle_*.deb "$work/trestle"
sed -i 's/^Version: .*/&+later/' "$work/trestle/DEBIAN/control"
dpkg-deb --root-owner-group --build "$work/trestle" "$root/packages/newer" >/dev/null
cp packaging/try_inside.sh "$root/packages/"
unshare --mount --pid --fork -- sh -c '
  mount --rbind "$1" "$1" && mount -t proc proc "$1/proc" && mount --rbind /dev "$1/dev" &&
  exec chroot "$1" env -i HOME=/root TERM=dumb PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    http_proxy="${http_proxy:-}" bash /packages/try_inside.sh' try "$root"
