#!/usr/bin/env bash
# Typed clients that others' generators make of what the daemon serves at /v1/openapi.json: openapi-typescript with
# openapi-fetch (session.ts), hey-api (hey.ts) and swagger-client (swagger.mjs). Each uploads a mesh, encodes it, follows
# its events, waits, and reads GLB; what is wrong does not compile (wrong.ts). And the rule sets of Spectral and Redocly
# for both forms of the description.
#
# The packages are those of package-lock.json, installed under the build folder once. Without node, or where the registry
# cannot be reached, it is skipped.
# srnfd-test: nightly
# srnfd-test: release-only
# srnfd-test: timeout 900
. "$(dirname "$0")/../support/lib.sh"

CLIENTS=tests/clients
MODULES=$ROOT/build/clients
MESH=$ROOT/tests/data/aal_subcortex/L_thalamus.ply
OFFLINE='code (ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ECONNRESET|ETIMEDOUT|ENETUNREACH|EHOSTUNREACH'
OFFLINE="$OFFLINE|ERR_SOCKET_TIMEOUT|SELF_SIGNED_CERT_IN_CHAIN|UNABLE_TO_[A-Z_]*)"

install_packages() {
    mkdir -p "$MODULES"
    if ! cmp -s $CLIENTS/package-lock.json "$MODULES/installed.json"; then
        cp $CLIENTS/package.json $CLIENTS/package-lock.json "$MODULES"
        (cd "$MODULES" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error --fetch-retries=1 \
            --fetch-timeout=60000) >"$SCRATCH/npm" 2>&1 || return 1
        cp $CLIENTS/package-lock.json "$MODULES/installed.json"
    fi
}

major=$(node --version 2>/dev/null | sed 's/^v\([0-9]*\).*/\1/')
[ "${major:-0}" -ge 18 ] || skip_all 'node 18 or newer is not installed'
if ! install_packages; then
    grep -qE "$OFFLINE" "$SCRATCH/npm" && skip_all 'the packages are not installed, and the registry cannot be reached'
    not_ok 'the packages are installed' "$(head -n 4 "$SCRATCH/npm")"
    done_testing
fi

start_server "$SCRATCH/data" --workers 1 || exit 1
cp $CLIENTS/*.ts $CLIENTS/*.mjs $CLIENTS/*.json $CLIENTS/spectral.yaml "$MODULES"
cp api/openapi.yaml "$MODULES"
get /v1/openapi.json
cp "$BODY" "$MODULES/openapi.json"

said() { # NAME COMMAND..: that it succeeds, in the folder of the packages
    local name=$1
    shift
    if (cd "$MODULES" && "$@") >"$SCRATCH/said" 2>&1; then
        ok "$name"
    else
        not_ok "$name" "$(head -n 40 "$SCRATCH/said")"
    fi
}
bin() { # NAME ARGUMENTS..: a program of the packages
    "$MODULES/node_modules/.bin/$1" "${@:2}"
}

for form in json yaml; do
    said "Spectral has nothing to say of openapi.$form" bin spectral lint --fail-severity hint -r spectral.yaml "openapi.$form"
    said "nor has Redocly" node "$ROOT/tests/lint/openapi.cjs" "$MODULES" "openapi.$form"
done
said 'openapi-typescript makes types' node generate.mjs openapi.json api.d.ts
is "$(grep -c 'unknown\[\]' "$MODULES/api.d.ts")" 0 'arrays have items'
said 'hey-api makes a client' bin openapi-ts
said 'what is right compiles, and what is wrong does not' bin tsc -p tsconfig.json
session() { # NAME FILE
    (cd "$MODULES" && node "$2" "$URL" "$MESH") >"$SCRATCH/session" 2>&1
    like "$(cat "$SCRATCH/session")" '^surf-[0-9a-f]{32} glTF 100$' "$1: a session"
}
for client in session hey; do
    said "$client.ts is bundled" bin esbuild $client.ts --bundle --platform=node --format=esm --outfile=$client.out.mjs \
        --log-level=error
done
session 'openapi-fetch' session.out.mjs
session 'hey-api' hey.out.mjs
session 'swagger-client' swagger.mjs

stop_server || not_ok 'the server ends well'
done_testing
