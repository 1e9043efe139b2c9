#!/bin/sh
# Puts the packages that the dashboard is built from, and its tests drive a browser with, under build/web, as the lock
# file names them. Does nothing where they are there. Fails with 3 where the registry cannot be reached.
set -eu
cd "$(dirname "$0")/.."
mkdir -p build/web
exec 9>build/web/lock
flock 9 # the linter and a test may both be here
if cmp -s web/package-lock.json build/web/installed.json; then
    exit 0
fi
cp web/package.json web/package-lock.json build/web/
log=build/web/npm.log
if ! (cd build/web && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error --fetch-retries=1 \
    --fetch-timeout=60000) >"$log" 2>&1 </dev/null 9>&-; then
    head -n 4 "$log" >&2
    if grep -qE 'code (ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ECONNRESET|ETIMEDOUT|ENETUNREACH|EHOSTUNREACH|ERR_SOCKET_TIMEOUT|SELF_SIGNED_CERT_IN_CHAIN|UNABLE_TO_[A-Z_]*)' "$log"; then
        exit 3
    fi
    exit 1
fi
cp web/package-lock.json build/web/installed.json
