#!/bin/sh
# Makes the Debian package of the release build.
#
#   deploy/deb.sh FOLDER      leaves FOLDER/srnfd_VERSION_ARCHITECTURE.deb
#
# The tree is staged under FOLDER and packed by dpkg-deb. The libraries that the package depends on are
# those of the binary, by dpkg-shlibdeps. Needs dpkg-dev; no root.
set -eu
cd "$(dirname "$0")/.."

out=${1:?usage: deploy/deb.sh FOLDER}
version=$(build/srnfd version | sed -n 's/^srnfd  *\([0-9.]*\).*/\1/p')
architecture=$(dpkg --print-architecture)
stage=$out/stage
package=$out/srnfd_${version}_$architecture.deb

rm -rf "$stage"
mkdir -p "$stage/DEBIAN"
install -D -m 755 -s build/srnfd "$stage/usr/bin/srnfd"
install -D -m 644 deploy/srnfd.service "$stage/lib/systemd/system/srnfd.service"
install -D -m 644 deploy/srnfd.sysusers "$stage/usr/lib/sysusers.d/srnfd.conf"
install -D -m 644 deploy/srnfd.json "$stage/etc/srnfd/srnfd.json"
install -D -m 644 api/openapi.yaml "$stage/usr/share/srnfd/openapi.yaml"
install -D -m 644 -t "$stage/usr/share/doc/srnfd" README.md deploy/OPERATIONS.md
install -D -m 644 deploy/nginx.conf "$stage/usr/share/doc/srnfd/examples/nginx.conf"
install -D -m 644 LICENSE "$stage/usr/share/doc/srnfd/copyright"

# dpkg-shlibdeps wants a source package around it.
mkdir -p "$out/debian"
printf 'Source: srnfd\n\nPackage: srnfd\nArchitecture: any\n' >"$out/debian/control"
libraries=$(cd "$out" && dpkg-shlibdeps -O stage/usr/bin/srnfd)
libraries=${libraries#shlibs:Depends=}
rm -rf "$out/debian"

cat >"$stage/DEBIAN/control" <<CONTROL
Package: srnfd
Version: $version
Architecture: $architecture
Maintainer: srnfd <srnfd@localhost>
Section: science
Priority: optional
Installed-Size: $(du -sk "$stage" | cut -f 1)
Depends: $libraries, systemd | systemd-standalone-sysusers | systemd-sysusers
Description: elastic shape analysis of closed surfaces as a service
 A daemon that takes triangle meshes over HTTP and computes their square-root
 normal fields, geodesics, registrations, means and principal components.
CONTROL
echo /etc/srnfd/srnfd.json >"$stage/DEBIAN/conffiles"

cat >"$stage/DEBIAN/postinst" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = configure ]; then
    systemd-sysusers srnfd.conf
    install -d -m 700 -o srnfd -g srnfd /var/lib/srnfd
    if [ -d /run/systemd/system ]; then
        systemctl daemon-reload
        systemctl enable srnfd.service
        systemctl restart srnfd.service
    fi
fi
SCRIPT
cat >"$stage/DEBIAN/prerm" <<'SCRIPT'
#!/bin/sh
set -e
if [ -d /run/systemd/system ] && [ "$1" = remove ]; then
    systemctl disable --now srnfd.service
fi
SCRIPT
# What was computed is not removed with the program: only an empty folder is.
cat >"$stage/DEBIAN/postrm" <<'SCRIPT'
#!/bin/sh
set -e
if [ "$1" = purge ]; then
    rmdir /var/lib/srnfd 2>/dev/null || true
    rmdir /etc/srnfd 2>/dev/null || true
fi
if [ -d /run/systemd/system ]; then
    systemctl daemon-reload
fi
SCRIPT
chmod 755 "$stage/DEBIAN/postinst" "$stage/DEBIAN/prerm" "$stage/DEBIAN/postrm"
dpkg-deb --root-owner-group --build "$stage" "$package" >/dev/null
rm -rf "$stage"
echo "$package"
