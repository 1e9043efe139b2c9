#!/usr/bin/env bash
# Installs the Debian packages in a clean system (debootstrap, in a folder), starts the daemon by its unit's command
# line, asks it, removes it again, builds an example with the library, and runs the Python client: "make test-deb".
# Needs root, debootstrap and a package mirror (SRNFD_MIRROR, or the one that apt uses); takes some minutes, so it is no
# part of "make check".
. "$(dirname "$0")/../support/lib.sh"

command -v debootstrap >/dev/null || skip_all 'no debootstrap'
[ "$(id -u)" -eq 0 ] || skip_all 'not root'

PACKAGE=$(ls build/deb/srnfd_*.deb 2>/dev/null | tail -n 1)
[ -n "$PACKAGE" ] || { echo 'no package: make deb' >&2; exit 1; }
CODENAME=$(. /etc/os-release && echo "$VERSION_CODENAME")
MIRROR=${SRNFD_MIRROR:-$(apt-cache policy 2>/dev/null | sed -n "s#.* \(http[^ ]*\) $CODENAME/main .*#\1#p" | head -n 1)}
SYSTEM=$SCRATCH/system

# debootstrap may leave /proc mounted in the system, which must not be removed with it.
leave() {
    local status=$?
    sed -n "s#^[^ ]* \($SYSTEM/[^ ]*\) .*#\1#p" /proc/mounts | xargs -r umount
    (exit "$status")
    clean_up
}
trap leave EXIT

inside() {
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive LC_ALL=C chroot "$SYSTEM" "$@"
}

if command -v lintian >/dev/null; then
    is "$(lintian --fail-on error,warning build/deb/*.deb 2>"$SCRATCH/lintian")" '' 'lintian finds nothing in the packages'
else
    skip 'lintian' 'it is not installed'
fi
mkdir "$SYSTEM"
if ! debootstrap --variant=minbase "$CODENAME" "$SYSTEM" "$MIRROR" >"$SCRATCH/debootstrap" 2>&1; then
    not_ok 'a clean system is made' "$(tail -n 5 "$SCRATCH/debootstrap")"
    done_testing
fi
ok 'a clean system is made'
cp "$PACKAGE" "$SYSTEM/tmp/srnfd.deb"
# What apt outside knows about proxies and certificates holds inside, too.
cp /etc/resolv.conf "$SYSTEM/etc/resolv.conf"
cp -r /etc/apt/apt.conf.d/. "$SYSTEM/etc/apt/apt.conf.d/" 2>/dev/null
inside apt-get -q update >"$SCRATCH/apt" 2>&1
check 'the package installs' inside apt-get -q install -y --no-install-recommends /tmp/srnfd.deb
inside sh -c 'find / -xdev | sort' >"$SCRATCH/installed"
is "$(inside stat -c '%U %a' /var/lib/srnfd)" 'srnfd 700' 'the data directory is the service user'"'"'s alone'
is "$(inside dpkg-query -W -f '${Conffiles}' srnfd | awk '{ print $1 }')" /etc/srnfd/srnfd.json \
    'the settings are a conffile'

# The unit's command line, as the unit's user, on a free port.
read -r -a COMMAND < <(sed -n 's/^ExecStart=//p' "$SYSTEM/lib/systemd/system/srnfd.service")
SERVER_LOG=$SCRATCH/server.log
env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin SRNFD_LISTEN=127.0.0.1:0 chroot --userspec=srnfd:srnfd "$SYSTEM" \
    "${COMMAND[@]}" </dev/null >/dev/null 2>"$SERVER_LOG" &
SERVER_PID=$!
SERVER_PIDS+=("$SERVER_PID")
for _ in $(seq 200); do
    ADDRESS=$(announced_address "$SERVER_LOG")
    [ -n "$ADDRESS" ] && break
    alive "$SERVER_PID" || break
    sleep 0.05
done
URL=http://$ADDRESS
like "$ADDRESS" '^127\.0\.0\.1:[0-9]+$' 'the daemon starts by its unit'"'"'s command line'
get /readyz
is "$STATUS" 200 'and is ready'
post '/v1/meshes?format=ply' --data-binary @tests/data/aal_subcortex/L_thalamus.ply
is "$STATUS" 201 'a mesh is accepted'
execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":8}"
is "$STATUS" 200 'and encoded'
if stop_server; then ok 'it drains'; else not_ok 'it drains' "$(tail -n 5 "$SERVER_LOG")"; fi
check 'the data are intact' inside srnfd check --data /var/lib/srnfd

check 'the package is purged' inside apt-get -q purge -y srnfd
is "$(inside dpkg -l srnfd 2>/dev/null | grep -c '^ii')" 0 'and gone'
is "$(inside sh -c 'find /usr /lib /etc -xdev -name "*srnfd*" 2>/dev/null')" '' 'with all its files'
isnt "$(inside ls /var/lib/srnfd)" '' 'but not the data'

# The library, by those who build with it.
cp build/deb/libsrnf*.deb "$SYSTEM/tmp"
cp tests/data/aal_subcortex/L_thalamus.ply "$SYSTEM/tmp"
check 'the library installs' inside sh -c 'apt-get -q install -y --no-install-recommends /tmp/libsrnf*.deb gcc libc6-dev pkg-config'
check 'an example compiles against it' inside sh -c \
    'cd /usr/share/doc/libsrnf-dev/examples && cc geodesic.c -o /tmp/geodesic $(pkg-config --cflags --libs srnf)'
check 'and runs' inside sh -c 'cd /tmp && ./geodesic L_thalamus.ply L_thalamus.ply'
check 'so does the other' inside sh -c \
    'cd /usr/share/doc/libsrnf-dev/examples && cc mean.c -o /tmp/mean $(pkg-config --cflags --libs srnf) -lm'
check 'it links statically, too' inside sh -c \
    'cd /usr/share/doc/libsrnf-dev/examples && cc geodesic.c -o /tmp/static $(pkg-config --cflags --libs --static srnf)'

# The Python client, by people of the lab.
cp build/deb/python3-srnf_*.deb "$SYSTEM/tmp"
check 'the Python client installs' inside sh -c 'apt-get -q install -y --no-install-recommends /tmp/python3-srnf_*.deb'
is "$(inside srnf --version)" "srnf $(make --no-print-directory version)" 'its command runs'
is "$(inside python3 -c 'import srnf; print(srnf.__version__)')" "$(make --no-print-directory version)" 'its module is there'
check 'it is purged' inside apt-get -q purge -y python3-srnf
is "$(inside sh -c 'find /usr -xdev -path "*srnf*" -name "*.py*"')" '' 'with all that was compiled'
done_testing
