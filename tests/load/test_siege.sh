#!/usr/bin/env bash
# srnfd-test: nightly
# srnfd-test: alone
# srnfd-test: release-only
# srnfd-test: timeout 300
# All attacks at once against a daemon with small limits: its memory stays within the formula of server/README.md, which is
# worked out here, and a well-behaved token is answered as if nothing were (load/siege.cjs).
#
#   SIEGE_SECONDS=20 tests/load/test_siege.sh
. "$(dirname "$0")/../support/lib.sh"

major=$(node --version 2>/dev/null | sed 's/^v\([0-9]*\).*/\1/')
[ "${major:-0}" -ge 18 ] || skip_all 'node 18 or newer is not installed'

DATA=$SCRATCH/data
MIB=$((1 << 20))
CONNECTIONS=400 WAITING=200 BUFFERED=$((192 * MIB)) UPLOADS=$((256 * MIB)) JOB=$((128 * MIB)) REQUESTS=4
token() { # NAME
    "$SRNFD" token add --data "$DATA" --name "$1" 2>/dev/null
}
GOOD=$(token ada)
BAD=$(token mallory),$(token moriarty),$(token milady)
start_server "$DATA" --workers 1 --access-log refusals --max-connections "$CONNECTIONS" --max-waiting "$WAITING" \
    --max-buffered "$BUFFERED" --upload-memory "$UPLOADS" --job-memory "$JOB" --request-threads "$REQUESTS" \
    --quota-requests 0 || exit 1
array() { # INTENT TYPE COUNT
    printf '<DataArray Intent="%s" DataType="%s" ArrayIndexingOrder="RowMajorOrder" Dimensionality="2" ' "$1" "$2"
    printf 'Dim0="%d" Dim1="3" Encoding="GZipBase64Binary" Endian="LittleEndian"><Data>' "$3"
    head -c $(($3 * 12)) /dev/zero | gzip -9 | base64 -w 0
    printf '</Data></DataArray>\n'
}
{
    printf '<?xml version="1.0"?>\n<GIFTI Version="1.0" NumberOfDataArrays="2">\n'
    array NIFTI_INTENT_POINTSET NIFTI_TYPE_FLOAT32 1200000
    array NIFTI_INTENT_TRIANGLE NIFTI_TYPE_INT32 2400000
    printf '</GIFTI>\n'
} >"$SCRATCH/bomb.gii"

resident() { # VmRSS or VmHWM, in bytes
    echo $(($(sed -n "s/^$1:[[:space:]]*\([0-9]*\) kB/\1/p" "/proc/$SERVER_PID/status") * 1024))
}
get /readyz
before=$(resident VmRSS)
seconds=${SIEGE_SECONDS:-20}
node tests/load/siege.cjs attack "$URL" $((seconds + 2)) "$BAD" "$SCRATCH/bomb.gii" "$CONNECTIONS" 3 \
    >"$SCRATCH/attack" 2>&1 &
attack=$!
sleep 1
node tests/load/siege.cjs behave "$URL" "$seconds" "$GOOD" >"$BODY" 2>"$SCRATCH/errors" ||
    not_ok 'the well-behaved side ends' "$(tail -n 5 "$SCRATCH/errors")"
wait "$attack" || not_ok 'the attacking side ends' "$(tail -n 5 "$SCRATCH/attack")"
note "well-behaved: $(cat "$BODY")"
note "attack: $(cat "$SCRATCH/attack")"
most=$(resident VmHWM)
# One response: the largest here are records. The transforms that jobs share, the database's cache and the heaps of the
# threads come on top, 64 MiB for all of them.
bound=$((WAITING * 1024 + CONNECTIONS * 104 * 1024 + BUFFERED + UPLOADS + REQUESTS * 8 * MIB + 2 * JOB + before + 64 * MIB))
note "resident: $((before / MIB)) MiB before, $((most / MIB)) MiB at most, bound $((bound / MIB)) MiB"
compare "$most" '<=' "$bound" 'memory stays within the formula'
is "$(json '.statuses | keys | map(select(. != "200" and . != "201")) | join(" ")')" '' 'a well-behaved token is served throughout'
compare "$(json .requests)" '>=' 200 'often enough to tell'
compare "$(json .p99)" '<' 50 'and 99 of 100 of its requests take less than 50 ms'
compare "$(jq '[.statuses[]] | add' "$SCRATCH/attack")" '>=' 5 'while the attacks came'
compare "$(jq .held "$SCRATCH/attack")" '>=' $((3 * CONNECTIONS / 4)) 'and places were held to the end'
stop_server || not_ok 'the daemon ends well'
done_testing
