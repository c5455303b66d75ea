#!/usr/bin/env bash
# debian13.sh [STAGE...]: `./run test STAGE...` (release, unless told otherwise) of what is committed, in a Debian 13
# of its own under build/debian13. Its Fast DDS is 3.x, its compiler GCC 14. Needs root, and a mirror of Debian.
# With DEBIAN13_ROOT the Debian 13 is in that folder; it may be there already.
set -euo pipefail
cd "$(dirname "$0")/.."
root=${DEBIAN13_ROOT:-$PWD/build/debian13}
stages=("$@")
((${#stages[@]})) || stages=(release)

if [[ $(id -u) != 0 ]]; then
  echo "error: this makes a root file system and changes into it: run it as root" >&2
  exit 1
fi
# debootstrap makes it beside that name, so that what is there is whole.
if [[ ! -e $root ]]; then
  if ! command -v debootstrap >/dev/null; then
    echo "==> Installing debootstrap" >&2
    mkdir -p "$(dirname "$root")"
    { apt-get update -q && apt-get install -q -y --no-install-recommends debootstrap; } >"$root.log" 2>&1 || {
      tail -n 5 "$root.log" >&2
      echo "error: debootstrap, which makes a Debian in a folder, cannot be installed" >&2
      exit 1
    }
  fi
  echo "==> Making a Debian 13 in $root" >&2
  rm -rf "$root.new"
  mkdir -p "$root.new"
  debootstrap --variant=minbase --include=git trixie "$root.new" "${DEBIAN_MIRROR:-http://deb.debian.org/debian}" \
    >"$root.log" 2>&1 || {
    tail -n 5 "$root.log" >&2
    echo "error: no Debian 13 could be made; the whole log is $root.log. DEBIAN_MIRROR names another mirror." >&2
    exit 1
  }
  mv "$root.new" "$root"
elif ! grep -qs '^VERSION_ID="13"' "$root/etc/os-release"; then
  echo "error: $root is there, but is no Debian 13" >&2
  exit 1
fi
cp /etc/resolv.conf "$root/etc/resolv.conf"
if [[ -e $root/trestle/.git ]]; then
  git -C "$root/trestle" fetch -q "$PWD" HEAD
  git -C "$root/trestle" reset -q --hard FETCH_HEAD
else
  git clone -q "$PWD" "$root/trestle"
fi
# The mounts are gone with the last process in there. Not by chroot alone, in which no test may make namespaces of its own.
exec unshare --mount -- sh -c '
  mount --rbind "$1" "$1" && mount -t proc proc "$1/proc" && mount --rbind /dev "$1/dev" &&
    mount -t sysfs sysfs "$1/sys" && mkdir -p "$1/outside" && cd "$1" && pivot_root . outside && umount -l outside || exit
  shift
  exec chroot . env -i HOME=/root TERM="${TERM:-dumb}" PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 \
    JOBS="${JOBS:-}" http_proxy="${http_proxy:-}" /trestle/run test "$@"' enter "$root" "${stages[@]}"
