#!/usr/bin/env bash
# One-use tickets for streams of events, and how answers travel: packed, in parts, kept by caches.
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
ADA=$("$SRNFD" token add --data "$DATA" --name ada --role user 2>/dev/null)
BEN=$("$SRNFD" token add --data "$DATA" --name ben --role user 2>/dev/null)
SEES=$("$SRNFD" token add --data "$DATA" --name ada --role viewer 2>/dev/null)
start_server "$DATA" --workers 1 || exit 1

as() { # TOKEN COMMAND ARGUMENTS..
    "${@:2}" --header "Authorization: Bearer $1"
}
ticket() { # TOKEN: prints a new one
    as "$1" post /v1/tickets
    json .ticket
}

# ---- Tickets -------------------------------------------------------------------------------------------

as "$ADA" post /v1/meshes --data-binary @tests/data/aal_subcortex/L_thalamus.ply
MESH=$(json .id)
as "$ADA" execute encode "{\"mesh\":\"$MESH\",\"lmax\":6}" --header 'Prefer: respond-async'
JOB=$(json .jobID)
post /v1/tickets
is_problem 401 token-required 'a ticket is for who has a token'
as "$ADA" post /v1/tickets --data '{"seconds":600}'
is_problem 422 invalid-input 'what a body says is not passed over'
as "$ADA" post /v1/tickets
T=$(json .ticket)
is "$STATUS $(header Cache-Control) $(json .expiresInSeconds)" '201 no-store 60' 'it is had for the asking'
like "$T" '^[0-9a-f]{32}$' 'and has 32 digits'
request HEAD "/v1/jobs/$JOB/events?ticket=$T" --head --max-time 60
is "$STATUS" 200 'HEAD looks at it'
get "/v1/jobs/$JOB/events?ticket=$T" --max-time 60
is "$STATUS $(header Content-Type)" '200 text/event-stream' 'a stream begins with it all the same'
get "/v1/jobs/$JOB/events?ticket=$T" --max-time 60
is_problem 401 token-required 'once'
get "/v1/jobs/$JOB?ticket=$(ticket "$ADA")"
is_problem 401 token-required 'and nothing else is had for it'
get "/v1/jobs/$JOB/events?ticket=$(ticket "$BEN")"
is_problem 404 no-such-job 'it sees what its token sees'
get "/v1/jobs/$JOB/events?ticket=$(ticket "$SEES")" --max-time 60
is "$STATUS" 200 'a viewer has one, too'
get "/v1/jobs/$JOB/events?ticket=${T//?/0}"
is_problem 401 token-required 'one that was never given opens nothing'
FIRST=$(ticket "$ADA")
for _ in 1 2 3 4 5 6 7 8; do
    T=$(ticket "$ADA")
done
get "/v1/jobs/$JOB/events?ticket=$FIRST"
is_problem 401 token-required 'the ninth takes the place of the first'
T=$(ticket "$BEN")
"$SRNFD" token revoke ben --data "$DATA" 2>/dev/null
get "/v1/jobs/$JOB/events?ticket=$T"
is_problem 401 token-required 'and goes with its token'

# ---- On the way ----------------------------------------------------------------------------------------

as "$ADA" get "/v1/meshes/$MESH/content"
is "$(header Cache-Control)" 'private, max-age=31536000, immutable' 'what an id is of may be kept for good'
like "$(header Vary)" 'Accept-Encoding' 'in either form'
TAG=$(header ETag)
SIZE=$(wc -c <"$BODY")
cp "$BODY" "$SCRATCH/whole"
as "$ADA" get "/v1/meshes/$MESH/content" --header "If-None-Match: $TAG"
is "$STATUS" 304 'and need not be sent twice'
is "$(header Vary)" Accept-Encoding 'and caches are told what it varies with'
as "$ADA" get "/v1/meshes/$MESH/content" --header 'Accept-Encoding: br, gzip;q=0.5'
is "$(header Content-Encoding) $(header ETag)" "gzip W/$TAG" 'it is packed for who takes gzip'
gzip -dc <"$BODY" >"$SCRATCH/unpacked"
check 'and the same' cmp "$SCRATCH/unpacked" "$SCRATCH/whole"
compare "$(wc -c <"$BODY")" '<' "$SIZE" 'in fewer bytes'
as "$ADA" get "/v1/meshes/$MESH/content" --header "If-None-Match: $(header ETag)"
is "$STATUS" 304 'known by the tag of either'
as "$ADA" get "/v1/meshes/$MESH/content" --header 'Accept-Encoding: gzip, deflate, br, zstd'
is "$(header Content-Encoding) $(header ETag)" "zstd W/$TAG" 'of two that are liked alike zstd is chosen'
zstd -qdc <"$BODY" >"$SCRATCH/unpacked"
check 'which is the same, too' cmp "$SCRATCH/unpacked" "$SCRATCH/whole"
as "$ADA" get "/v1/meshes/$MESH/content" --header 'Accept-Encoding: zstd;q=0.5, gzip;q=0.8'
is "$(header Content-Encoding)" gzip 'otherwise what is liked better'
as "$ADA" get "/v1/meshes/$MESH/content?format=ply" --header 'Accept-Encoding: zstd'
is "$STATUS $(header Content-Encoding)" '200 zstd' 'what is parsed for the request is packed in its account'
as "$ADA" get "/v1/meshes/$MESH/content" --header 'Accept-Encoding: gzip;q=0, zstd;q=0'
is "$(header Content-Encoding)" '' 'not for who refuses it'
as "$ADA" get /v1/version --header 'Accept-Encoding: gzip'
is "$(header Content-Encoding)" '' 'what is small is not packed'
as "$ADA" get '/v1/processes?_=1700000000' --header 'Accept-Encoding: gzip'
is "$STATUS $(header Content-Encoding) $(gzip -dc <"$BODY" | jq -r '.processes[0].id')" '200 gzip extract' \
    'JSON is packed, and parameters that begin with _ are passed over'
get_range() { # RANGE [ARGUMENTS..]
    as "$ADA" get "/v1/meshes/$MESH/content" --header "Range: $1" "${@:2}"
}
get_range bytes=100-299
is "$STATUS $(header Content-Range)" "206 bytes 100-299/$SIZE" 'a part of it'
check 'is that part' cmp "$BODY" <(tail -c +101 "$SCRATCH/whole" | head -c 200)
get_range bytes=-5 --header "If-Range: $TAG"
is "$STATUS $(wc -c <"$BODY")" '206 5' 'the last bytes, of the same content'
get_range bytes=-5 --header 'If-Range: "other"'
is "$STATUS $(wc -c <"$BODY")" "200 $SIZE" 'of another it is all'
get_range "bytes=$((SIZE - 3))-"
is "$STATUS $(header Content-Range)" "206 bytes $((SIZE - 3))-$((SIZE - 1))/$SIZE" 'from a place to the end'
get_range "bytes=$SIZE-"
is_problem 416 range-not-satisfiable 'beyond the end there is nothing'
is "$(header Content-Range)" "bytes */$SIZE" 'and it is said how much there is'
for range in bytes=99999999999999999999- bytes=18446744073709551616-18446744073709551617 "bytes=$SIZE-99999999999999999999"; do
    get_range "$range"
    is_problem 416 range-not-satisfiable "$range is beyond the end, too"
done
get_range "bytes=$((SIZE - 3))-99999999999999999999"
is "$STATUS $(header Content-Range)" "206 bytes $((SIZE - 3))-$((SIZE - 1))/$SIZE" 'an end beyond 2^64 is the end'
get_range bytes=-99999999999999999999
is "$STATUS $(header Content-Range)" "206 bytes 0-$((SIZE - 1))/$SIZE" 'as many last bytes as that are all'
for range in bytes=5-3 bytes=0-1,4-5 bytes= bytes=a-b lines=1-2; do
    get_range "$range"
    is "$STATUS $(wc -c <"$BODY")" "200 $SIZE" "$range is passed over"
done

stop_server || not_ok 'the server ends well'
done_testing
