#!/usr/bin/env bash
# test_kept_encodings.sh - the encoding of a mesh is made once: every process that needs it again finds it, also after a
# restart, with the same numbers and warnings as if it had been made anew. Other options, another owner and a damaged row
# make it anew.
# srnfd-test: no-asan (api/test_exports.sh and fuzz/test_api.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
TOKEN=$("$SRNFD" token add --data "$DATA" --name ada --role admin 2>/dev/null)
OTHER=$("$SRNFD" token add --data "$DATA" --name bob 2>/dev/null)
as() { # TOKEN COMMAND..
    "${@:2}" --header "Authorization: Bearer $1"
}
encodings() { # made and kept since the start of the server
    as "$TOKEN" get /metrics
    sed -n 's/^srnfd_encodings_total{source="\(.*\)"} \(.*\)/\1 \2/p' "$BODY" | sort -r | tr '\n' ' '
}
upload() { # TOKEN FILE
    as "$1" post /v1/meshes --data-binary "@$2"
    json .id
}
numbers() { json '[.matrix, .warnings] | tojson'; }
figures() { json '[.fit, .distortion, .warnings, (.surface | del(.source, .created))] | tojson'; }
# Runs a process, the jobs of before and their results deleted.
again() { # PROCESS INPUTS
    as "$TOKEN" get "/v1/jobs?process=$1"
    for id in $(json '.jobs[].id'); do
        as "$TOKEN" request DELETE "/v1/jobs/$id"
    done
    as "$TOKEN" execute "$1" "$2"
}
encode() { again encode "$1"; }

start_server "$DATA" || exit 1
A=$(upload "$TOKEN" tests/data/aal_subcortex/L_pallidum.ply)
B=$(upload "$TOKEN" tests/data/aal_subcortex/R_pallidum.ply)
is "$(encodings)" '' 'nothing is encoded yet'
encode "{\"mesh\":\"$A\"}"
FIT=$(figures)
is "$(encodings)" 'made 1 ' 'the first encoding is made'
as "$TOKEN" execute distances "{\"surfaces\":[\"$A\",\"$B\"],\"metric\":\"harmonic\"}"
MATRIX=$(numbers)
is "$(encodings)" 'made 2 kept 1 ' 'another process finds it'
encode "{\"mesh\":\"$A\"}"
is "$(figures)" "$FIT" 'and so does a second encode, with all its figures'
is "$(encodings)" 'made 2 kept 2 ' 'which makes none either'
as "$TOKEN" execute encode "{\"mesh\":\"$A\",\"lmax\":12}"
as "$TOKEN" execute encode "{\"mesh\":\"$A\",\"mirror\":true}"
is "$(encodings)" 'made 4 kept 2 ' 'other options are another encoding'
as "$OTHER" post /v1/meshes --data-binary @tests/data/aal_subcortex/L_pallidum.ply
as "$OTHER" execute encode "{\"mesh\":\"$A\"}"
is "$(encodings)" 'made 5 kept 2 ' 'nobody is answered from what others have'

# A poor encoding is told each time.
C=$(upload "$TOKEN" tests/data/aal_subcortex/L_caudate.ply)
encode "{\"mesh\":\"$C\",\"lmax\":4}"
WARNED=$(figures)
like "$WARNED" '"encoding-poor"' 'a poor encoding is warned of'
stop_server
start_server "$DATA" || exit 1
encode "{\"mesh\":\"$C\",\"lmax\":4}"
is "$(figures)" "$WARNED" 'a kept encoding is warned of like a new one'
is "$(encodings)" 'kept 1 ' 'after a restart it is still there'
again distances "{\"surfaces\":[\"$A\",\"$B\"],\"metric\":\"harmonic\"}"
is "$(numbers)" "$MATRIX" 'as it is for others, with the numbers of before'
is "$(encodings)" 'kept 3 ' 'and none is made'
stop_server

sqlite3 "$DATA/srnfd.db" "UPDATE encoding SET value = zeroblob(length(value))"
start_server "$DATA" || exit 1
as "$TOKEN" execute distances "{\"surfaces\":[\"$A\",\"$B\",\"$C\"],\"metric\":\"harmonic\"}"
is "$(json '[.matrix[][:2]][:2] | tojson')" "$(jq -c '.[0]' <<<"$MATRIX")" 'what is damaged decides nothing'
is "$(encodings)" 'made 3 ' 'and is made anew'
stop_server

start_server "$DATA" --kept-encodings 0 || exit 1
as "$TOKEN" execute distances "{\"surfaces\":[\"$B\",\"$A\"],\"metric\":\"harmonic\"}"
encode "{\"mesh\":\"$A\"}"
is "$(encodings | cut -d ' ' -f 1,3)" 'made ' 'it can be turned off'
done_testing
