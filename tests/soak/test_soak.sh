#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: slow
# One daemon under many cheap requests and small jobs: memory, descriptors, database and its log stay as they are
# after the warm-up (soak/soak.cjs has the limits, and prints the figures).
#
#   REQUESTS=6000 JOBS=60 GROWTH=0.2 tests/soak/test_soak.sh
#
# "make soak" sends 1000000, runs 5000, and allows 0.05: in a run as short as this the warm-up ends before the
# caches of the connections and of the database are full.
. "$(dirname "$0")/../support/lib.sh"

major=$(node --version 2>/dev/null | sed 's/^v\([0-9]*\).*/\1/')
[ "${major:-0}" -ge 18 ] || skip_all 'node 18 or newer is not installed'

start_server "$SCRATCH/data" --workers 2 --access-log refusals || exit 1
node tests/soak/soak.cjs "$URL" "$SERVER_PID" "$SCRATCH/data" "${REQUESTS:-6000}" "${JOBS:-60}" \
    "${GROWTH:-0.2}" >"$SCRATCH/soak" 2>&1
status=$?
note "$(cat "$SCRATCH/soak")"
is "$status" 0 'nothing grows'
if stop_server; then
    ok 'the daemon ends well'
else
    not_ok 'the daemon ends well'
fi
check 'its data is sound' "$SRNFD" check --data "$SCRATCH/data"
done_testing
