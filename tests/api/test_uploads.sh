#!/usr/bin/env bash
# srnfd-test: timeout 240
# srnfd-test: slow
# Bodies that take long to parse keep nobody waiting: they have threads of their own, of which one owner never has all,
# and one account of memory; they end when the client goes, and when the daemon does.
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
token() { # NAME [ARGUMENTS OF token add..]
    local name=$1
    shift
    "$SRNFD" token add --data "$DATA" --name "$name" "$@" 2>/dev/null
}

# A small file that unpacks to many vertices and faces: gzip's form of nothing but zeros. Faces name vertex 0 alone, so
# that the mesh is read in full, and repaired down to nothing.
array() { # INTENT TYPE COUNT BYTES-OF-A-ROW
    printf '<DataArray Intent="%s" DataType="%s" ArrayIndexingOrder="RowMajorOrder" Dimensionality="2" ' "$1" "$2"
    printf 'Dim0="%d" Dim1="3" Encoding="GZipBase64Binary" Endian="LittleEndian"><Data>' "$3"
    head -c $(($3 * $4)) /dev/zero | gzip -9 | base64 -w 0
    printf '</Data></DataArray>\n'
}
bomb() { # VERTICES FACES
    printf '<?xml version="1.0"?>\n<GIFTI Version="1.0" NumberOfDataArrays="2">\n'
    array NIFTI_INTENT_POINTSET NIFTI_TYPE_FLOAT32 "$1" 12
    array NIFTI_INTENT_TRIANGLE NIFTI_TYPE_INT32 "$2" 12
    printf '</GIFTI>\n'
}
scale=1
[ -n "$SRNFD_SANITIZED" ] && scale=4
bomb $((1200000 / scale)) $((2400000 / scale)) >"$SCRATCH/bomb.gii"
note "the bomb has $(wc -c <"$SCRATCH/bomb.gii") bytes"

# Uploads a bomb in the background; a few bytes more make it another file each time.
upload() { # TOKEN NUMBER
    {
        cat "$SCRATCH/bomb.gii"
        printf '<!-- %d -->\n' "$2"
    } >"$SCRATCH/bomb-$2"
    curl --silent --output "$SCRATCH/answer-$2" --write-out '%{http_code}' --header "Authorization: Bearer $1" \
        --data-binary "@$SCRATCH/bomb-$2" "$URL/v1/meshes?format=gii" >"$SCRATCH/status-$2" &
    UPLOADS+=("$!")
}
now_ms() { date +%s%3N; }
uploads_run() {
    local pid
    for pid in "${UPLOADS[@]}"; do
        alive "$pid" && return 0
    done
    return 1
}
memory_in_use() {
    get /metrics --header "Authorization: Bearer $MONITOR"
    sed -n 's/^srnfd_upload_memory_bytes //p' "$BODY"
}

"$SRNFD" token add --data "$DATA" --name first >/dev/null 2>&1
MALLORY=$(token mallory)
ADA=$(token ada)
MONITOR=$(token monitor --role metrics)
start_server "$DATA" --workers 1 --access-log all || exit 1

# ---- Nobody waits ----------------------------------------------------------------------------------------

UPLOADS=()
began=$(now_ms)
for i in 1 2 3 4 5 6; do
    upload "$MALLORY" "$i"
done
slowest=0 probes=0 ada=0 sent=
while uploads_run; do
    for path in /readyz /metrics /v1/meshes; do
        token=$ADA
        [ "$path" = /metrics ] && token=$MONITOR
        at=$(now_ms)
        get "$path" --header "Authorization: Bearer $token"
        took=$(($(now_ms) - at))
        [ "$STATUS" = 200 ] || not_ok "$path is answered while bodies are parsed" "$STATUS"
        [ "$took" -gt "$slowest" ] && slowest=$took
        probes=$((probes + 1))
    done
    if [ -z "$sent" ]; then
        sent=yes
        at=$(now_ms)
        post '/v1/meshes' --header "Authorization: Bearer $ADA" --data-binary @tests/data/aal_subcortex/L_thalamus.ply
        ada=$(($(now_ms) - at))
        is "$STATUS" 201 'another owner uploads meanwhile'
    fi
    sleep 0.02
done
took=$(($(now_ms) - began))
note "six uploads took $took ms, the slowest of $probes other requests $slowest ms, a small upload of another owner $ada ms"
compare "$slowest" '<' $((took / 4)) 'short requests wait for no body that is parsed'
compare "$ada" '<' $((took / 2)) 'and a small upload of another owner for few'
compare "$probes" '>' 5 'and enough of them were timed'
is "$(cat "$SCRATCH"/status-* | sort -u)" 201201201201201201 'and each upload is answered'
is "$(json_of=$SCRATCH/answer-1; jq -r .report.analysable "$json_of")" false 'as what it is'

# ---- A client that goes ------------------------------------------------------------------------------------

UPLOADS=()
for i in 11 12 13 14 15 16; do
    upload "$MALLORY" "$i"
done
for _ in $(seq 200); do
    [ "$(memory_in_use)" = 0 ] || break
    sleep 0.02
done
isnt "$(memory_in_use)" 0 'what is parsed is charged'
kill "${UPLOADS[@]}"
wait "${UPLOADS[@]}" 2>/dev/null
gone() {
    jq -r 'select(.event == "request" and .code == "request-timeout") | .id' "$SERVER_LOG" | wc -l
}
# All uploads so far, the one of the other owner among them, have ended: between two of them no memory is in use either.
uploads_logged() {
    jq -r 'select(.event == "request" and .method == "POST") | .id' "$SERVER_LOG" | wc -l
}
at=$(now_ms)
for _ in $(seq 400); do
    [ "$(uploads_logged)" -ge 13 ] && [ "$(memory_in_use)" = 0 ] && break
    sleep 0.05
done
note "what clients left behind ended after $(($(now_ms) - at)) ms"
compare "$(gone)" ">=" 2 'uploads whose clients have gone are given up'
compare "$(($(now_ms) - at))" '<' $((took * 2 / 3)) 'and not parsed to their ends'
is "$(memory_in_use)" 0 'and hold no memory'

# ---- The daemon's end --------------------------------------------------------------------------------------

kill_server
start_server "$DATA" --workers 1 --grace-seconds 1 || exit 1
UPLOADS=()
for i in 21 22 23 24 25 26 27 28; do
    upload "$MALLORY" "$i"
done
sleep 0.3
at=$(now_ms)
stop_server || not_ok 'the server ends well while bodies are parsed'
ended=$(($(now_ms) - at))
note "SIGTERM while eight bodies were parsed: ended after $ended ms"
compare "$ended" '<' $((1000 + took / 10)) 'SIGTERM ends uploads with the grace'
wait "${UPLOADS[@]}" 2>/dev/null
like "$(cat "$SCRATCH"/status-2?)" '503' 'those that were not parsed are told to come again'

# ---- One account of memory ---------------------------------------------------------------------------------

start_server "$DATA" --workers 1 --upload-memory $((64 << 20)) || exit 1
bomb 800000 1600000 >"$SCRATCH/bomb.gii"
UPLOADS=()
upload "$MALLORY" 31
wait "${UPLOADS[@]}"
is "$(cat "$SCRATCH/status-31")" 413 'what needs more than there is for all uploads is refused'
is "$(jq -r .code "$SCRATCH/answer-31")" body-too-large 'with its code'
like "$(jq -r .detail "$SCRATCH/answer-31")" '64 MiB' 'and the limit'
# Each of these fits alone, two do not.
bomb $((350000)) $((700000)) >"$SCRATCH/bomb.gii"
UPLOADS=()
for i in 41 42 43; do
    upload "$MALLORY" "$i"
    upload "$ADA" "$((i + 10))"
done
wait "${UPLOADS[@]}"
is "$(cat "$SCRATCH"/status-4? "$SCRATCH"/status-5?)" 201201201201201201 'what finds no room beside others is read alone'
is "$(memory_in_use)" 0 'and all memory is given back'
stop_server || not_ok 'the server ends well'
done_testing
