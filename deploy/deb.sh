#!/bin/sh
# Makes the Debian packages of the release build.
#
#   deploy/deb.sh FOLDER      leaves in FOLDER, each named NAME_VERSION_ARCHITECTURE.deb:
#
#     srnfd         the daemon, its unit, settings and manual
#     libsrnfX.Y    the shared library
#     libsrnf-dev   what programs are built with: headers, archive, pkg-config file, manual, examples
#     python3-srnf  the Python client and the command srnf, for every architecture
#
# Each tree is staged under FOLDER and packed by dpkg-deb; the libraries that a package depends on are those of its
# binary, by dpkg-shlibdeps. DEBFULLNAME and DEBEMAIL name the maintainer. Needs dpkg-dev; no root.
set -eu
cd "$(dirname "$0")/.."

out=${1:?usage: deploy/deb.sh FOLDER}
version=$(make --no-print-directory version)
architecture=$(dpkg --print-architecture)
multiarch=$(dpkg-architecture -qDEB_HOST_MULTIARCH)
maintainer="${DEBFULLNAME:-srnfd developers} <${DEBEMAIL:-developers@srnfd.invalid}>"
stamp=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || stat -c %Y CHANGELOG.md)}
library=libsrnf${version%.*}
rm -rf "$out/stage"
mkdir -p "$out/stage"

# Every package has its copyright and its changes under its own name.
documents() { # PACKAGE
    doc=$out/stage/$1/usr/share/doc/$1
    install -D -m 644 deploy/copyright "$doc/copyright"
    {
        printf 'srnfd (%s) unstable; urgency=medium\n\n  * See CHANGELOG.md.\n\n' "$version"
        printf ' -- %s  %s\n' "$maintainer" "$(LC_ALL=C date -u -R -d "@$stamp")"
    } | gzip -9n >"$doc/changelog.gz"
}

# The libraries that a binary needs. dpkg-shlibdeps wants a source package around it.
needs() { # BINARY
    mkdir -p "$out/debian"
    printf 'Source: srnfd\n\nPackage: srnfd\nArchitecture: any\n' >"$out/debian/control"
    (cd "$out" && dpkg-shlibdeps -O "stage/$1" 2>/dev/null) | sed -n 's/^shlibs:Depends=//p'
    rm -rf "$out/debian"
}

# Packs a staged tree. The description comes from standard input, its first line the short one.
pack() { # PACKAGE SECTION MULTI-ARCH DEPENDS [ARCHITECTURE [RECOMMENDS]]
    tree=$out/stage/$1
    built=${5:-$architecture}
    mkdir -p "$tree/DEBIAN"
    find "$tree/usr/share/man" -type f ! -name '*.gz' -exec gzip -9n {} + 2>/dev/null || true
    (cd "$tree" && find . -path ./DEBIAN -prune -o -type f ! -path './etc/*' -printf '%P\0' | sort -z |
        xargs -0 md5sum) >"$tree/DEBIAN/md5sums"
    cat >"$tree/DEBIAN/control" <<CONTROL
Package: $1
Source: srnfd
Version: $version
Architecture: $built
Multi-Arch: $3
Maintainer: $maintainer
Section: $2
Priority: optional
Installed-Size: $(du -sk --exclude=DEBIAN "$tree" | cut -f 1)
Depends: $4
$([ $# -lt 6 ] || echo "Recommends: $6"; sed -e '1s/^/Description: /' -e '2,$s/^/ /')
CONTROL
    chmod -R u+w,go-w "$tree"
    dpkg-deb --root-owner-group --build "$tree" "$out/$1_${version}_$built.deb" >/dev/null
    echo "$out/$1_${version}_$built.deb"
}

# ---- srnfd ----------------------------------------------------------------------------------------------

stage=$out/stage/srnfd
make --no-print-directory -s install-service DESTDIR="$stage" PREFIX=/usr
strip --remove-section=.comment --remove-section=.note "$stage/usr/bin/srnfd"
install -D -m 644 deploy/srnfd.service "$stage/lib/systemd/system/srnfd.service"
install -D -m 644 deploy/srnfd-worker.service "$stage/lib/systemd/system/srnfd-worker.service"
install -D -m 644 deploy/srnfd.sysusers "$stage/usr/lib/sysusers.d/srnfd.conf"
install -D -m 644 deploy/srnfd.json "$stage/etc/srnfd/srnfd.json"
documents srnfd
mkdir -p "$stage/DEBIAN"
echo /etc/srnfd/srnfd.json >"$stage/DEBIAN/conffiles"

# Enabling, starting and stopping as Debian's packages do it: an administrator's "disable" and "mask" are kept, and
# policy-rc.d is asked.
cat >"$stage/DEBIAN/postinst" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = configure ] || [ "$1" = abort-upgrade ] || [ "$1" = abort-remove ]; then
    systemd-sysusers srnfd.conf
    install -d -m 700 -o srnfd -g srnfd /var/lib/srnfd
    deb-systemd-helper unmask srnfd.service >/dev/null || true
    if deb-systemd-helper --quiet was-enabled srnfd.service; then
        deb-systemd-helper enable srnfd.service >/dev/null || true
    else
        deb-systemd-helper update-state srnfd.service >/dev/null || true
    fi
    if [ -d /run/systemd/system ]; then
        systemctl --system daemon-reload >/dev/null || true
        if [ -n "$2" ]; then action=restart; else action=start; fi
        deb-systemd-invoke $action srnfd.service >/dev/null || true
    fi
fi
SCRIPT
cat >"$stage/DEBIAN/prerm" <<'SCRIPT'
#!/bin/sh
set -e
if [ -d /run/systemd/system ] && [ "$1" = remove ]; then
    deb-systemd-invoke stop srnfd.service srnfd-worker.service >/dev/null || true
fi
SCRIPT
# What was computed is not removed with the program: only an empty folder is.
cat >"$stage/DEBIAN/postrm" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = remove ] && command -v deb-systemd-helper >/dev/null; then
    deb-systemd-helper mask srnfd.service >/dev/null || true
fi
if [ "$1" = purge ]; then
    if command -v deb-systemd-helper >/dev/null; then
        deb-systemd-helper purge srnfd.service >/dev/null || true
        deb-systemd-helper unmask srnfd.service >/dev/null || true
    fi
    rmdir /var/lib/srnfd 2>/dev/null || true
    rmdir /etc/srnfd 2>/dev/null || true
fi
if [ "$1" = remove ] && [ -d /run/systemd/system ]; then
    systemctl --system daemon-reload >/dev/null || true
fi
SCRIPT
chmod 755 "$stage/DEBIAN/postinst" "$stage/DEBIAN/prerm" "$stage/DEBIAN/postrm"
pack srnfd science foreign "$(needs srnfd/usr/bin/srnfd), init-system-helpers (>= 1.54~), \
systemd | systemd-standalone-sysusers | systemd-sysusers" "$architecture" ca-certificates <<'TEXT'
elastic shape analysis of closed surfaces as a service
A daemon that takes triangle meshes over HTTP and computes their square-root
normal fields, geodesics, registrations, means and principal components.
TEXT

# ---- The library ----------------------------------------------------------------------------------------

develop=$out/stage/libsrnf-dev
stage=$out/stage/$library
make --no-print-directory -s install-library DESTDIR="$develop" PREFIX=/usr MULTIARCH="$multiarch" \
    EXAMPLEDIR=/usr/share/doc/libsrnf-dev/examples
mkdir -p "$stage/usr/lib/$multiarch" "$stage/DEBIAN"
mv "$develop/usr/lib/$multiarch"/libsrnf.so.* "$stage/usr/lib/$multiarch"
soname=libsrnf.so.${version%.*}
strip --strip-unneeded --remove-section=.comment --remove-section=.note "$stage/usr/lib/$multiarch/libsrnf.so.$version"
strip --strip-debug --remove-section=.comment "$develop/usr/lib/$multiarch/libsrnf.a"
echo "libsrnf ${version%.*} $library (>= $version)" >"$stage/DEBIAN/shlibs"
echo 'activate-noawait ldconfig' >"$stage/DEBIAN/triggers"
[ -L "$stage/usr/lib/$multiarch/$soname" ] # what the loader looks for
documents "$library"
pack "$library" libs same "$(needs "$library/usr/lib/$multiarch/libsrnf.so.$version")" <<'TEXT'
elastic shape analysis of closed surfaces
libsrnf encodes triangle meshes of closed surfaces in spherical harmonics and
compares them by square-root normal fields: registration, distances,
geodesics, means, principal components, comparison of groups.
.
This package has the shared library.
TEXT

documents libsrnf-dev
pack libsrnf-dev libdevel same "$library (= $version), libfftw3-dev, liblapacke-dev, libopenblas-dev, libglpk-dev, \
libexpat1-dev, zlib1g-dev" <<'TEXT'
elastic shape analysis of closed surfaces (development files)
libsrnf encodes triangle meshes of closed surfaces in spherical harmonics and
compares them by square-root normal fields: registration, distances,
geodesics, means, principal components, comparison of groups.
.
This package has the headers, the static library and two example programs.
TEXT

# ---- The Python client ----------------------------------------------------------------------------------

stage=$out/stage/python3-srnf
packages=$stage/usr/lib/python3/dist-packages
make --no-print-directory -s install-python DESTDIR="$stage" PREFIX=/usr PYTHONDIR=/usr/lib/python3/dist-packages
install -D -m 644 -t "$stage/usr/share/doc/python3-srnf" clients/python/README.md docs/python.md
install -D -m 644 -t "$stage/usr/share/doc/python3-srnf/examples" clients/python/examples/*.py
mkdir -p "$stage/usr/share/bash-completion/completions" "$stage/usr/share/fish/vendor_completions.d" "$stage/DEBIAN"
for shell in bash fish; do
    PYTHONPATH=$packages /usr/bin/python3 -B -m srnf completion $shell >"$out/completion.$shell"
done
mv "$out/completion.bash" "$stage/usr/share/bash-completion/completions/srnf"
mv "$out/completion.fish" "$stage/usr/share/fish/vendor_completions.d/srnf.fish"
documents python3-srnf
# Compiled where it is installed, by that system's Python, and cleaned up before it goes.
printf '#!/bin/sh\nset -e\n[ "$1" != configure ] || py3compile -p python3-srnf\n' >"$stage/DEBIAN/postinst"
printf '#!/bin/sh\nset -e\npy3clean -p python3-srnf\n' >"$stage/DEBIAN/prerm"
chmod 755 "$stage/DEBIAN/postinst" "$stage/DEBIAN/prerm"
pack python3-srnf python foreign 'python3 (>= 3.9), python3-numpy' all python3-matplotlib <<'TEXT'
elastic shape analysis of closed surfaces (Python client)
The client of srnfd: uploads, jobs, results as arrays, whole studies from a
folder of meshes, and figures. The command srnf does a study from the shell:
upload, encode, register, mean, components, comparison of groups,
classification, figures, tables and a report.
TEXT
rm -rf "$out/stage"
