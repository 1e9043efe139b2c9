#!/usr/bin/env bash
# deploy/install-deps.sh decides right, tried against a pretended dpkg and apt: nothing is done when all is
# there; only what is missing is installed; alternatives, root, sudo and foreign systems are handled.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/support/lib.sh"

# The pretended system: a folder with programs, a file with one installed package a line, one with the
# packages that apt knows, and a log of the calls of apt-get. The real PATH is not searched.
FAKE=$SCRATCH/bin
mkdir "$FAKE"
for tool in sh bash env sed head tr id test cat grep; do
    ln -s "$(command -v "$tool")" "$FAKE/$tool"
done

tool() { # NAME, the script on standard input
    rm -f "$FAKE/$1"
    { printf '#!/bin/sh\nsystem=%s\n' "$SCRATCH" && cat; } >"$FAKE/$1"
    chmod +x "$FAKE/$1"
}

tool dpkg-query <<'END'
for name in "$@"; do :; done
grep -qx -- "$name" "$system/installed" || exit 1
printf installed
END
tool apt-cache <<'END'
case $1 in
depends) echo '  Depends: clang-14' ;;
show) for name in "$@"; do :; done; grep -qx -- "$name" "$system/known" ;;
esac
END
tool apt-get <<'END'
echo "$DEBIAN_FRONTEND: $*" >>"$system/log"
case " $* " in
*' install '*)
    for name in "$@"; do
        if grep -qx -- "$name" "$system/known"; then
            echo "$name" >>"$system/installed"
        fi
    done ;;
esac
END
tool id <<'END'
cat "$system/uid"
END
for name in node npm nginx; do
    tool "$name" </dev/null
done
export SRNFD_TOOLS=$SCRATCH/tools

base='gcc make libc6-dev pkg-config libmicrohttpd-dev libgnutls28-dev libjansson-dev libopenblas-pthread-dev
    liblapacke-dev libsqlite3-dev libfftw3-dev zlib1g-dev libexpat1-dev libsodium-dev libglpk-dev libarchive-dev
    libcurl4-gnutls-dev libutf8proc-dev libzstd-dev python3-yaml curl jq'
tests='libcmocka-dev libsharp-dev libpng-dev clang clang-format binutils sqlite3 shellcheck ca-certificates openssl
    perl-base python3-jsonschema python3-owslib python3-numpy python3-matplotlib python3-pip python3-setuptools python3-wheel
    python3-venv mypy unzip zip zstd libclang-rt-14-dev chromium'

# A system with these packages installed, root, and all packages known.
system() { # PACKAGES..
    printf '%s\n' "$@" >"$SCRATCH/installed"
    printf '%s\n' $base $tests nodejs npm >"$SCRATCH/known"
    echo 0 >"$SCRATCH/uid"
    : >"$SCRATCH/log"
}

install_deps() { # ARGUMENTS..
    OUTPUT=$(PATH=$FAKE deploy/install-deps.sh "$@" 2>&1 </dev/null)
    RESULT=$?
    LOG=$(cat "$SCRATCH/log")
}

system $base
install_deps
is "$RESULT:$LOG" '0:' 'with everything there apt-get is not called'
like "$OUTPUT" 'everything is there' 'and it says so'

system $base $tests
install_deps --tests
is "$RESULT:$LOG" '0:' 'nor with everything there for the tests'

system $base
echo dpkg-dev >>"$SCRATCH/known"
install_deps --package
like "$RESULT:$LOG" '^0:.* install .* dpkg-dev python3-numpy$' 'making the Debian package needs more'

system ${base/libglpk-dev/}
install_deps
is "$RESULT" 0 'a missing package is installed'
like "$LOG" ' update' 'after the lists were fetched'
like "$LOG" 'noninteractive: .* install -y --no-install-recommends libglpk-dev$' 'it alone, and quietly'
install_deps
is "$(grep -c install "$SCRATCH/log")" 1 'a second run does nothing'

system
install_deps
for package in $base; do
    grep -qx "$package" "$SCRATCH/installed" || not_ok "$package is installed on a bare system"
done
is "$RESULT:$(grep -c . <<<"$LOG")" '0:2' 'a bare system takes one update and one install'

system $base
install_deps --tests
is "$RESULT" 0 'the tests need more'
like "$LOG" 'libsharp-dev' 'libsharp is among it'
like "$LOG" 'libclang-rt-14-dev' "and the runtime of this release's clang"
unlike "$LOG" 'npm' 'node and npm are left alone where they are programs already'

rm "$FAKE/node" "$FAKE/npm"
system $base $tests
install_deps --tests
like "$LOG" 'install .* nodejs npm$' 'and installed where they are not'
for name in node npm; do
    tool "$name" </dev/null
done

# Its PATH has /usr/sbin too, where a real one may be.
if [ ! -x /usr/sbin/nginx ]; then
    rm "$FAKE/nginx"
    for name in rm mkdir dpkg; do
        ln -s "$(command -v "$name")" "$FAKE/$name"
    done
    system $base $tests
    echo nginx >>"$SCRATCH/known"
    install_deps --tests
    is "$RESULT" 0 'where nginx cannot be unpacked everything else goes on'
    like "$OUTPUT" 'nginx cannot be had' 'and it says so'
    like "$LOG" 'download nginx' 'which was tried'
    unlike "$LOG" ' install ' 'without installing it'
    rm "$FAKE/dpkg"
    tool dpkg <<'END'
mkdir -p usr/sbin && sed 1q /dev/null >usr/sbin/nginx && chmod +x usr/sbin/nginx
END
    ln -s "$(command -v chmod)" "$FAKE/chmod"
    install_deps --tests
    check 'where it can, its program is in the folder' test -x "$SCRATCH/tools/usr/sbin/nginx"
    : >"$SCRATCH/log"
    install_deps --tests
    is "$RESULT:$(cat "$SCRATCH/log")" '0:' 'and a second run does nothing'

    echo gojq >>"$SCRATCH/known"
    rm "$FAKE/dpkg"
    tool dpkg </dev/null
    install_deps --tests
    is "$RESULT" 0 'where gojq cannot be unpacked everything else goes on'
    like "$OUTPUT" 'gojq cannot be had' 'and it says so'
    like "$LOG" 'download gojq' 'which was tried'
    rm "$FAKE/dpkg"
    tool dpkg <<'END'
mkdir -p usr/bin && sed 1q /dev/null >usr/bin/gojq && chmod +x usr/bin/gojq
END
    install_deps --tests
    check 'where it can, its program is in the folder' test -x "$SCRATCH/tools/usr/bin/gojq"
    : >"$SCRATCH/log"
    install_deps --tests
    is "$RESULT:$(cat "$SCRATCH/log")" '0:' 'and a second run downloads nothing'
    tool nginx </dev/null
fi

system ${base/pkg-config/pkgconf}
install_deps
is "$RESULT:$LOG" '0:' 'an alternative that is installed meets the need'

system $base ${tests/libclang-rt-14-dev/}
sed -i '/libclang-rt-14-dev/d' "$SCRATCH/known"
echo libclang-common-14-dev >>"$SCRATCH/known"
install_deps --tests
like "$LOG" 'install .* libclang-common-14-dev$' 'an alternative is chosen where the first name is unknown'

system ${base/libsodium-dev/}
sed -i '/libsodium-dev/d' "$SCRATCH/known"
install_deps
is "$RESULT" 1 'a package that the release does not have is an error'
like "$OUTPUT" 'no package for: libsodium-dev' 'that names it'
unlike "$LOG" ' install ' 'and nothing is installed by halves'

system ${base/libsodium-dev/}
echo 1000 >"$SCRATCH/uid"
install_deps
is "$RESULT:$LOG" '1:' 'without root and sudo nothing is tried'
like "$OUTPUT" 'needs root, or sudo' 'and the message says what is needed'

tool sudo <<'END'
echo "sudo $*" >>"$system/log"
[ "$1" = -n ] && shift
exec "$@"
END
install_deps
is "$RESULT" 0 'without root it goes through sudo'
like "$LOG" 'sudo -n env DEBIAN_FRONTEND=noninteractive apt-get' 'which must not ask where nobody can answer'
rm "$FAKE/sudo"

system $base
rm "$FAKE/apt-get"
install_deps
is "$RESULT" 1 'on a system without apt it fails'
for library in libmicrohttpd GnuTLS jansson OpenBLAS LAPACKE SQLite FFTW zlib expat libsodium GLPK; do
    like "$OUTPUT" "$library" "and names $library"
done

install_deps --all
is "$RESULT" 2 'an unknown option is a usage error'

done_testing
