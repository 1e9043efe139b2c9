#!/usr/bin/env bash
# Requests drawn from api/openapi.yaml against the daemon (fuzz/api/fuzz.cjs says what is asked of the answers),
# and afterwards: the daemon lives, ends well, and its data is sound.
#
#   SEED="102 114" REQUESTS=400 tests/fuzz/test_api.sh
#
# Each seed draws the same requests again. Without SEED they are some that have found faults, so that a run fails for what
# was changed and for nothing else. SEED=random takes another one and prints it: so does "make fuzz-api" with 20000
# requests, and test_api_random.sh in "make nightly".
#
# The packages that it is built on are those of fuzz/api/package-lock.json, installed under the build folder
# once. Without node, or where the registry cannot be reached, it is skipped.
# srnfd-test: slow
# srnfd-test: once (requests that break something break it with sanitizers)
. "$(dirname "$0")/../support/lib.sh"

FUZZER=tests/fuzz/api
MODULES=$ROOT/build/fuzz-api
REQUESTS=${REQUESTS:-400}
SEED=${SEED:-102 114}
[ "$SEED" != random ] || SEED=$(od -An -N3 -tu4 /dev/urandom | tr -d ' ')

OFFLINE='code (ENOTFOUND|EAI_AGAIN|ECONNREFUSED|ECONNRESET|ETIMEDOUT|ENETUNREACH|EHOSTUNREACH'
OFFLINE="$OFFLINE|ERR_SOCKET_TIMEOUT|SELF_SIGNED_CERT_IN_CHAIN|UNABLE_TO_[A-Z_]*)"

# Installs the packages. The lock keeps the runs of two builds from installing at once.
install_packages() {
    mkdir -p "$MODULES"
    exec 9>"$MODULES/lock"
    flock 9
    if ! cmp -s $FUZZER/package-lock.json "$MODULES/installed.json"; then
        cp $FUZZER/package.json $FUZZER/package-lock.json "$MODULES"
        (cd "$MODULES" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error --fetch-retries=1 \
            --fetch-timeout=60000) >"$SCRATCH/npm" 2>&1 9>&- || return 1
        cp $FUZZER/package-lock.json "$MODULES/installed.json"
    fi
    exec 9>&-
}

major=$(node --version 2>/dev/null | sed 's/^v\([0-9]*\).*/\1/')
[ "${major:-0}" -ge 18 ] || skip_all 'node 18 or newer is not installed'
if ! install_packages; then
    grep -qE "$OFFLINE" "$SCRATCH/npm" && skip_all 'the packages are not installed, and the registry cannot be reached'
    not_ok 'the packages are installed' "$(head -n 4 "$SCRATCH/npm")"
    done_testing
fi

for seed in $SEED; do
    # Jobs end soon, so that a mean that was drawn at degree 127 does not keep the rest waiting.
    start_server "$SCRATCH/data-$seed" --workers 2 --job-seconds 5 --sync-wait-seconds 1 --max-queued 60 || exit 1
    node $FUZZER/fuzz.cjs "$MODULES" api/openapi.yaml "$URL" "$REQUESTS" "$seed" >"$SCRATCH/fuzz" 2>&1
    status=$?
    note "$(cat "$SCRATCH/fuzz")"
    is "$status" 0 "seed $seed: no answer breaks what the description promises"

    get /healthz
    is "$STATUS" 200 'the daemon lives'
    if stop_server; then
        ok 'and ends well'
    else
        not_ok 'and ends well'
    fi
    check 'its data is sound' "$SRNFD" check --data "$SCRATCH/data-$seed"
done
done_testing
