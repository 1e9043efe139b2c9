#!/bin/sh
# Installs what srnfd is built from, on Debian and Ubuntu, through apt.
#
#   deploy/install-deps.sh           what building and running needs (and curl and jq, for the demo)
#   deploy/install-deps.sh --tests   and what the tests, the linters and the sanitizers need
#   deploy/install-deps.sh --package and what making the Debian package needs
#
# nginx is not installed but unpacked into build/tools: as a package it would start a service.
# gojq, which tests alone use, is unpacked beside it.
# Only what is missing is installed, and the package lists are fetched only when something is missing, so
# that on a machine that has everything this is a look at dpkg's database: no network, no root, no time.
# Without root it goes through sudo. On any other system it names the libraries and fails.
#
# A line of a list is one need. Names joined by | are alternatives: the need is met by whichever is
# installed, and otherwise by the first one that this release has.
set -eu
export LC_ALL=C # what apt says is looked for in English

# python3-yaml derives what is served beside api/openapi.yaml (api/derive.py).
BASE='
gcc
make
libc6-dev
pkg-config|pkgconf
libmicrohttpd-dev
libgnutls28-dev
libjansson-dev
libopenblas-pthread-dev
liblapacke-dev
libsqlite3-dev
libfftw3-dev
zlib1g-dev
libexpat1-dev
libsodium-dev
libglpk-dev
libarchive-dev
libcurl4-gnutls-dev|libcurl4-openssl-dev
libutf8proc-dev
libzstd-dev
python3-yaml
curl
jq
'

# libsharp is the transform's oracle and yardstick, libpng draws the pictures of `make paper`, shellcheck and
# clang-format serve the linter, and chromium opens the dashboard. OWSLib is a client of the standard that the service
# follows. The Python client needs numpy and, for figures, matplotlib; mypy checks its types, and pip with setuptools
# and wheel builds it into an environment of its own.
TESTS='
libcmocka-dev
libsharp-dev
libpng-dev
clang
clang-format
binutils
sqlite3
shellcheck
ca-certificates
openssl
perl-base
python3-jsonschema
python3-owslib
python3-numpy
python3-matplotlib
python3-pip
python3-setuptools
python3-wheel
python3-venv
mypy
unzip
zip
zstd
'

# Where a release has no package of it (on Ubuntu it is a snap), the tests that need a browser are skipped.
BROWSER=chromium

PACKAGE='
dpkg-dev
python3-numpy
'

say() {
    printf 'install-deps: %s\n' "$*" >&2
}

usage() {
    say 'usage: deploy/install-deps.sh [--tests | --package]'
    exit 2
}

installed() {
    test "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed
}

known_to_apt() {
    apt-cache show --no-all-versions "$1" >/dev/null 2>&1
}

# The libraries of clang's sanitizers and of libFuzzer follow the release's clang in version and, before
# they had a package of their own, lay in libclang-common.
clang_runtime() {
    version=$(clang --version 2>/dev/null | sed -n 's/.*clang version \([0-9]*\).*/\1/p' | head -n 1)
    if [ -z "$version" ]; then
        version=$(apt-cache depends clang 2>/dev/null |
            sed -n 's/.*Depends: clang-\([0-9]*\).*/\1/p' | head -n 1)
    fi
    if [ -n "$version" ]; then
        echo "libclang-rt-$version-dev|libclang-rt-dev|libclang-common-$version-dev"
    else
        echo 'libclang-rt-dev'
    fi
}

browser() {
    if ! installed "$BROWSER" && known_to_apt "$BROWSER"; then
        echo "$BROWSER"
    fi
}

# npm is part of some builds of nodejs, so that programs are looked for here, not packages.
node_programs() {
    command -v node >/dev/null 2>&1 || echo nodejs
    command -v npm >/dev/null 2>&1 || echo npm
}

needs() {
    echo "$BASE"
    if [ "$with_tests" = yes ]; then
        echo "$TESTS"
        clang_runtime
        browser
        node_programs
    fi
    if [ "$with_package" = yes ]; then
        echo "$PACKAGE"
    fi
}

# Prints the needs that no installed package meets, one a line.
missing() {
    for need in $(needs); do
        met=no
        for name in $(echo "$need" | tr '|' ' '); do
            if installed "$name"; then
                met=yes
                break
            fi
        done
        [ "$met" = yes ] || echo "$need"
    done
}

# Prints one package for each need given. A need that this release has no package for is an error.
choose() {
    unknown=
    for need in "$@"; do
        chosen=
        for name in $(echo "$need" | tr '|' ' '); do
            if known_to_apt "$name"; then
                chosen=$name
                break
            fi
        done
        if [ -n "$chosen" ]; then
            echo "$chosen"
        else
            unknown="$unknown $need"
        fi
    done
    if [ -n "$unknown" ]; then
        say "this release has no package for:$unknown"
        return 1
    fi
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif [ "$interactive" = yes ]; then
        sudo "$@"
    else
        sudo -n "$@"
    fi
}

apt() {
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300 \
        -o Acquire::Retries=3 "$@" </dev/null
}

# Installed, nginx would run as a service. Its program alone, unpacked, is enough for tests/deploy/test_nginx.sh,
# which is skipped where it cannot be had.
nginx_there() {
    PATH=$PATH:/usr/sbin command -v nginx >/dev/null 2>&1 || test -x "$TOOLS/usr/sbin/nginx"
}

unpack_nginx() {
    known_to_apt nginx || apt update || true
    for name in nginx nginx-light; do
        rm -rf "$TOOLS"
        mkdir -p "$TOOLS"
        (cd "$TOOLS" && apt-get -q download "$name" && dpkg -x "$name"_*.deb .) >&2 </dev/null || true
        if nginx_there; then
            say "unpacked: $name, into build/tools"
            return
        fi
    done
    say 'nginx cannot be had: its test will be skipped'
}

# Tests ask gojq what they would ask jq, which takes ten times as long; where it cannot be had they ask jq. It is looked
# for once more after an installation, which has fetched the package lists.
gojq_there() {
    command -v gojq >/dev/null 2>&1 || test -x "$TOOLS/usr/bin/gojq"
}

unpack_gojq() {
    if [ "$with_tests" = no ] || gojq_there || ! known_to_apt gojq; then
        return
    fi
    mkdir -p "$TOOLS"
    (cd "$TOOLS" && apt-get -q download gojq && dpkg -x gojq_*.deb .) >&2 </dev/null || true
    if gojq_there; then
        say 'unpacked: gojq, into build/tools'
    else
        say 'gojq cannot be had: tests will ask jq, which takes longer'
    fi
}

# Without a terminal sudo must not wait for a password that nobody can type.
interactive=no
if [ -t 0 ]; then
    interactive=yes
fi
with_tests=no
with_package=no
TOOLS=${SRNFD_TOOLS:-${0%/*}/../build/tools}
case "$#:${1-}" in
0:) ;;
1:--tests) with_tests=yes ;;
1:--package) with_package=yes ;;
*) usage ;;
esac

if ! command -v dpkg-query >/dev/null 2>&1 || ! command -v apt-get >/dev/null 2>&1; then
    say 'this system has no apt (Debian and Ubuntu have). Please install, with their headers:'
    say 'a C17 compiler, make, pkg-config, libmicrohttpd, GnuTLS, jansson, OpenBLAS with LAPACKE'
    say '(threads, not OpenMP), SQLite 3, FFTW 3, zlib, expat, libsodium, GLPK, libarchive, libcurl, libzstd, utf8proc; and the programs curl and jq.'
    say 'For the tests also: cmocka, libsharp, libpng, clang with its sanitizers, clang-format, binutils,'
    say 'shellcheck, node and npm (18 or newer), sqlite3, openssl, perl, zip, unzip, zstd, chromium, nginx (its'
    say 'program alone), Python 3 with numpy, matplotlib, pip, setuptools, wheel, venv and mypy.'
    exit 1
fi

if [ "$with_tests" = yes ] && ! nginx_there; then
    unpack_nginx
fi
unpack_gojq

wanted=$(missing)
if [ -z "$wanted" ]; then
    say 'everything is there'
    exit 0
fi

if [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null 2>&1; then
    say 'missing:' $wanted
    say 'installing needs root, or sudo, and neither is there. As root: deploy/install-deps.sh' "$@"
    exit 1
fi

say 'missing:' $wanted
apt update
# The lists may have taught apt which clang the release has, so the needs are worked out again.
wanted=$(missing)
packages=$(choose $wanted)
apt install -y --no-install-recommends $packages

left=$(missing)
if [ -n "$left" ]; then
    say 'still missing after the installation:' $left
    exit 1
fi
unpack_gojq
say 'installed:' $packages
