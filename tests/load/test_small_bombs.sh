#!/usr/bin/env bash
# srnfd-test: nightly
# srnfd-test: alone
# srnfd-test: release-only
# srnfd-test: timeout 200
# Three tokens send small files that hold large meshes and documents, as fast as they are answered. A fourth is served
# as if nothing were: its short requests at once, and its small meshes after one such file at most, not after one of
# each token (http/lane.c).
#
#   BOMB_SECONDS=10 tests/load/test_small_bombs.sh
. "$(dirname "$0")/../support/lib.sh"

major=$(node --version 2>/dev/null | sed 's/^v\([0-9]*\).*/\1/')
[ "${major:-0}" -ge 18 ] || skip_all 'node 18 or newer is not installed'

DATA=$SCRATCH/data
token() { # NAME
    "$SRNFD" token add --data "$DATA" --name "$1" 2>/dev/null
}
GOOD=$(token ada)
BAD=("$(token mallory)" "$(token moriarty)" "$(token milady)")
start_server "$DATA" --workers 1 --access-log refusals --quota-requests 0 || exit 1
array() { # INTENT TYPE COUNT
    printf '<DataArray Intent="%s" DataType="%s" ArrayIndexingOrder="RowMajorOrder" Dimensionality="2" ' "$1" "$2"
    printf 'Dim0="%d" Dim1="3" Encoding="GZipBase64Binary" Endian="LittleEndian"><Data>' "$3"
    head -c $(($3 * 12)) /dev/zero | gzip -9 | base64 -w 0
    printf '</Data></DataArray>\n'
}
bomb() { # VERTICES
    printf '<?xml version="1.0"?>\n<GIFTI Version="1.0" NumberOfDataArrays="2">\n'
    array NIFTI_INTENT_POINTSET NIFTI_TYPE_FLOAT32 "$1"
    array NIFTI_INTENT_TRIANGLE NIFTI_TYPE_INT32 $((2 * $1))
    printf '</GIFTI>\n'
}
bomb 200000 >"$SCRATCH/bomb-0" # what the thread for small bodies would have memory for, in ten KB
{
    printf '{"name":"x","members":[{}'
    printf ',{}%.0s' {1..300000}
    printf ']}'
} >"$SCRATCH/bomb-1"

attack() { # TOKEN NUMBER, until it is ended; the first six send meshes
    local n=0 kind=$(($2 / 6)) path='/v1/meshes?format=gii' type=application/octet-stream
    [ "$kind" = 1 ] && path=/v1/cohorts type=application/json
    while :; do
        n=$((n + 1))
        {
            cat "$SCRATCH/bomb-$kind"
            printf '%*s' $(($2 * 1000 + n)) ''
        } | curl --silent --output /dev/null --write-out '%{http_code}\n' --max-time 60 --request POST \
            --header "Authorization: Bearer $1" --header "Content-Type: $type" --data-binary @- "$URL$path"
    done >>"$SCRATCH/answers-$2" 2>/dev/null
}
attackers=()
for i in 0 1 2 3 4 5 6 7 8; do
    attack "${BAD[$((i % 3))]}" "$i" &
    attackers+=("$!")
done
sleep 1
node tests/load/siege.cjs behave "$URL" "${BOMB_SECONDS:-10}" "$GOOD" >"$BODY" 2>"$SCRATCH/errors" ||
    not_ok 'the well-behaved side ends' "$(tail -n 5 "$SCRATCH/errors")"
kill "${attackers[@]}"
wait "${attackers[@]}" 2>/dev/null
note "well-behaved: $(cat "$BODY")"
note "attack: $(sort "$SCRATCH"/answers-* | uniq -c | tr -s ' \n' ' ')"
is "$(json '.statuses | keys | map(select(. != "200" and . != "201")) | join(" ")')" '' 'a well-behaved token is served throughout'
compare "$(json .p99)" '<' 50 '99 of 100 of its short requests take less than 50 ms'
compare "$(json .uploads)" '>=' 2 'it sends small meshes'
compare "$(json .medianUpload)" '<' 500 'which wait for no turn of each of the others'
compare "$(json .slowestUpload)" '<' 1000 'and never long'
compare "$(cat "$SCRATCH"/answers-* | grep -c '^[24]')" '>=' 10 'while the attacks came'
stop_server || not_ok 'the daemon ends well'
done_testing
