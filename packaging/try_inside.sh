#!/usr/bin/env bash
# try_inside.sh: the part of try_packages.sh that runs in the new Debian. Each step says what it shows.
set -euo pipefail
say() { echo "==> $*"; }
die() { echo "error: $*" >&2; exit 1; }
quietly() { "$@" >/tmp/log 2>&1 || { cat /tmp/log >&2; die "$*"; }; }
# What is there, but for what dpkg, apt and the linker keep for themselves.
listing() {
  find / -xdev \( -path /proc -o -path /dev -o -path /packages -o -path /tmp -o -path /var/lib/apt -o -path /var/cache -o -path /var/log \
    -o -path /var/lib/dpkg -o -path /etc/ld.so.cache -o -path '/etc/*-' -o -path /var/lib/systemd \) -prune -o -print | sort
}
quietly apt-get update -q
printf '#!/bin/sh\nexit 101\n' >/usr/sbin/policy-rc.d  # nothing is started in here
chmod +x /usr/sbin/policy-rc.d
# The packages that ours needs stay after a purge: without them it is shown what ours leaves behind.
depends=$(dpkg-deb --field /packages/trestle_*.deb Depends | sed 's/ *([^)]*)//g; s/,/ /g')
quietly apt-get install -q -y --no-install-recommends $depends
! command -v g++ >/dev/null || die "there is a compiler, which users need not have"
listing >/tmp/before

say "Installs"
quietly apt-get install -q -y --no-install-recommends /packages/trestle_*.deb
trestle --version
trestle check --quiet /usr/share/doc/trestle/examples/*.yaml /usr/share/doc/trestle/examples/*/bridge.yaml
man trestle-bridge | grep -q 'Run the bridge' || die "man trestle-bridge shows nothing"
completed=$(bash -ic 'source /usr/share/bash-completion/bash_completion; _completion_loader trestle
  COMP_WORDS=(trestle che); COMP_CWORD=1; _trestle; echo "${COMPREPLY[@]}"' 2>/dev/null)
[[ $completed == check ]] || die "bash completes 'trestle che' to '$completed'"

say "A bridge runs as a user without rights"
mkdir -p /etc/trestle
cp /usr/share/doc/trestle/examples/bridge_a.yaml /etc/trestle/vehicle.yaml
setpriv --reuid=65534 --regid=65534 --clear-groups --no-new-privs --inh-caps=-all \
  trestle bridge /etc/trestle/vehicle.yaml >/tmp/bridge.log 2>&1 &
bridge=$!
for _ in $(seq 600); do
  ! grep -q 'offers\|ready\|running' /tmp/bridge.log || break
  kill -0 $bridge 2>/dev/null || break
  sleep 0.1
done
kill -TERM $bridge 2>/dev/null || { cat /tmp/bridge.log >&2; die "the bridge ended"; }
wait $bridge || { cat /tmp/bridge.log >&2; die "the bridge ended with $?"; }

say "Upgrades, and leaves configurations as they are"
echo '# mine' >>/etc/trestle/vehicle.yaml
quietly apt-get install -q -y --no-install-recommends /packages/newer/trestle_*.deb
[[ $(dpkg-query -W -f '${Version}' trestle) == *+later ]] || die "it did not upgrade"
tail -n 1 /etc/trestle/vehicle.yaml | grep -qx '# mine' || die "the configuration has changed"

say "The libraries of the core need tl::expected alone"
apt-get install -q -y --no-install-recommends --simulate /packages/libtrestle-core-dev_*.deb | sed -n 's/^Inst \([^ ]*\).*/\1/p' | sort >/tmp/core
[[ $(xargs </tmp/core) == "libexpected-dev libtrestle-core-dev" ]] || die "these come with it: $(xargs </tmp/core)"

say "Removed, it keeps configurations; purged, it leaves nothing"
quietly apt-get remove -q -y trestle
[[ -e /etc/trestle/vehicle.yaml ]] || die "the configuration is gone"
mkdir -p /var/lib/private/trestle/vehicle /etc/systemd/system/multi-user.target.wants
ln -sf /lib/systemd/system/trestle@.service /etc/systemd/system/multi-user.target.wants/trestle@vehicle.service
quietly apt-get purge -q -y trestle
rmdir --ignore-fail-on-non-empty -p /var/lib/private /etc/systemd/system/multi-user.target.wants 2>/dev/null || true
listing >/tmp/after
left=$(comm -13 /tmp/before /tmp/after)
[[ -z $left ]] || die "this is left: $left"
say "Good"
