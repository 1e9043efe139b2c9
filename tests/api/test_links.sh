#!/usr/bin/env bash
# test_links.sh - links in inputs to another server: off by default; what the settings allow and what they do not; what
# a server may do to a request; what was fetched belongs to the caller, and a job needs that server no more.
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

mkdir "$SCRATCH/files"
cp tests/data/aal_subcortex/L_thalamus.ply "$SCRATCH/files/thalamus.ply"
cp tests/data/aal_subcortex/L_putamen.ply "$SCRATCH/files/putamen.ply"
cp tests/data/aal_volume/subcortex.nii.gz "$SCRATCH/files/subcortex.nii.gz"
: >"$SCRATCH/asked"
/usr/bin/python3 tests/api/link_server.py "$SCRATCH/files" "$SCRATCH/asked" >"$SCRATCH/port" &
SERVES=$!
SERVER_PIDS+=("$SERVES") # ended with the script
for _ in $(seq 100); do
    [ -s "$SCRATCH/port" ] && break
    sleep 0.05
done
PORT=$(cat "$SCRATCH/port")
THERE=http://127.0.0.1:$PORT/meshes

encode() { # HREF [CURL ARGUMENTS..]
    execute encode "{\"mesh\":{\"href\":\"$1\"},\"lmax\":4}" "${@:2}"
}
refused() { # HREF STATUS CODE DETAIL-REGEX NAME
    encode "$1"
    is_problem "$2" "$3" "$5"
    like "$(json '[.detail, (.errors // [])[].detail] | join(" ")')" "$4" "$5: and why"
}

# ---- Off ------------------------------------------------------------------------------------------------

start_server "$SCRATCH/data" --workers 1 || exit 1
refused "$THERE/thalamus.ply" 422 invalid-input 'nothing is fetched from elsewhere' 'by default a link stays here'
stop_server
start_server "$SCRATCH/data" --workers 1 --link-prefixes "$THERE/" || exit 1
refused "$THERE/thalamus.ply" 422 link-failed 'not public.*--link-networks' 'an address that is not public must be listed'
stop_server
is "$(wc -l <"$SCRATCH/asked")" 0 'so far nobody was asked'
for wrong in "$THERE" "http://127.0.0.1:$PORT" "http:///127.0.0.1:$PORT/" ftp://127.0.0.1/ http://ada:secret@127.0.0.1/ 'http://127.0.0.1/?a/' 127.0.0.1/ "$THERE/,,$THERE/"; do
    timeout 20 "$SRNFD" serve --data "$SCRATCH/none" --listen 127.0.0.1:0 --link-prefixes "$wrong" 2>"$SCRATCH/refused"
    is "$?" 2 "$wrong is no prefix"
    like "$(cat "$SCRATCH/refused")" 'link-prefixes.*(path that ends in a slash|empty)' "$wrong is no prefix: and why"
done
long=$(printf 'http://127.0.0.1/%0200d/,' $(seq 18))
timeout 20 "$SRNFD" serve --data "$SCRATCH/none" --listen 127.0.0.1:0 --link-prefixes "$long$long" 2>"$SCRATCH/refused"
is "$?" 2 'more prefixes than the setting may have'
like "$(cat "$SCRATCH/refused")" '1 to 4095 characters' 'with their length'
for wrong in localhost 10.0.0.0/33 10.0.0.0/x ::1/129; do
    timeout 20 "$SRNFD" serve --data "$SCRATCH/none" --listen 127.0.0.1:0 --link-networks "$wrong" 2>"$SCRATCH/refused"
    is "$?" 2 "$wrong is no network"
done

# ---- On -------------------------------------------------------------------------------------------------

serve() { # ARGUMENTS..
    start_server "$SCRATCH/data" --workers 1 --link-prefixes "$long$THERE/" --link-networks 127.0.0.0/8 "$@" || exit 1
}
serve --link-seconds 2 --max-body 4000000 --grace-seconds 2
encode "$THERE/thalamus.ply"
is "$STATUS" 200 'a mesh of another server is encoded'
SURFACE=$(json .surface.id) MESH=$(json .surface.source.mesh)
get "/v1/meshes/$MESH"
is "$(json .name)" thalamus 'it is a mesh of the caller, by its name'
post /v1/meshes --data-binary @tests/data/aal_subcortex/L_thalamus.ply
is "$STATUS $(json .id)" "200 $MESH" 'the same as one that is uploaded'
encode "$THERE/near"
is "$STATUS $(json .surface.id)" "200 $SURFACE" 'redirections within the prefix are followed'
execute distances "{\"surfaces\":[{\"href\":\"$THERE/thalamus.ply\",\"type\":\"model/ply\"},
    {\"href\":\"$THERE/putamen.ply\"}],\"register\":false}"
is "$STATUS $(json '.matrix | length')" '200 2' 'lists of links too'
execute extract "{\"volume\":{\"href\":\"$THERE/subcortex.nii.gz\"},\"labels\":[77],\"smoothing\":0}"
is "$STATUS" 200 'and a volume is one'
execute encode "{\"\\u006desh\":{\"\\u0068ref\":\"$THERE/thalamus.ply\"},\"lmax\":4}"
is "$STATUS $(json .surface.id)" "200 $SURFACE" 'however the names are written'

# ---- Where links lead ------------------------------------------------------------------------------------

asked=$(wc -l <"$SCRATCH/asked")
for elsewhere in "${THERE%/*}/elsewhere/thalamus.ply" "$THERE/../elsewhere/thalamus.ply" \
    "$THERE/%2e%2e/elsewhere/thalamus.ply" "$THERE/..%2felsewhere/thalamus.ply" "$THERE/..%5celsewhere" \
    "http://localhost:$PORT/meshes/thalamus.ply" "http://ada@127.0.0.1:$PORT/meshes/thalamus.ply" \
    "https://127.0.0.1:$PORT/meshes/thalamus.ply" "http://127.0.0.1/meshes/thalamus.ply" file:///etc/passwd \
    "http://127.0.0.1:$PORT/meshe" "//127.0.0.1:$PORT/meshes/thalamus.ply" "$THERE/a b" "gopher://127.0.0.1:$PORT/meshes/"; do
    refused "$elsewhere" 422 invalid-input '--link-prefixes' "nothing is fetched from $elsewhere"
done
is "$(wc -l <"$SCRATCH/asked")" "$asked" 'and nobody was asked for it'
refused "$THERE/away" 422 link-failed 'redirects to where' 'nor by a redirection'
refused "$THERE/file" 422 link-failed 'redirects to where' 'nor from a file'
unlike "$(cat "$SCRATCH/asked")" elsewhere 'which was not asked for'
refused "$THERE/round" 422 link-failed 'more than 5' 'a server that sends round in circles'

# ---- What servers do ---------------------------------------------------------------------------------------

refused "$THERE/missing" 422 link-failed 'status 404' 'what is not there'
refused "$THERE/page" 422 unparsable-mesh '/inputs/mesh' 'a page is no mesh'
refused "$THERE/heads" 422 link-failed 'link' 'an endless head'
refused "$THERE/line" 422 link-failed 'line that is too long' 'an endless line of a head'
refused "$THERE/long" 413 body-too-large '4000000' 'more than a body may have, as announced'
refused "$THERE/endless" 413 body-too-large '4000000' 'and as it comes'
began=$(date +%s)
refused "$THERE/slow" 422 link-failed 'link-seconds' 'a server that takes its time'
compare $(($(date +%s) - began)) '<=' 10 'which is given up'

# ---- What is refused anyway --------------------------------------------------------------------------------

asked=$(wc -l <"$SCRATCH/asked")
L="{\"href\":\"$THERE/thalamus.ply\"}"
vain() { # PROCESS INPUTS DETAIL-REGEX NAME
    execute "$1" "$2"
    is_problem 422 invalid-input "$4"
    like "$(json '[.errors[] | .pointer + " " + .detail] | join(" | ")')" "$3" "$4: and why"
    is "$(wc -l <"$SCRATCH/asked")" "$asked" "$4: nobody was asked"
}
vain distances "{\"surfaces\":$(jq -nc --argjson link "$L" '[range(17) | $link]')}" 'at most 16' 'more links than a request may have'
vain encode "{\"mesh\":$L,\"nonsense\":1}" '^/inputs/nonsense' 'an input that is not known'
vain encode "{\"mesh\":$L,\"lmax\":9999}" '^/inputs/lmax' 'a number out of range'
vain encode "{\"mesh\":{\"href\":\"$THERE/thalamus.ply\",\"nonsense\":1}}" '^/inputs/mesh' 'a link with other members'
vain encode "{\"mesh\":{\"href\":\"$THERE/thalamus.ply\",\"value\":1}}" '^/inputs/mesh' 'a link beside a value'
vain encode "{\"mesh\":$L,\"lmax\":$L}" '^/inputs/lmax' 'a link in the place of a number'
vain geodesic "{\"from\":$L,\"to\":$L,\"nonsense\":$L}" '^/inputs/nonsense' 'a link that is no input'
vain project "{\"model\":$L,\"surfaces\":[$L]}" '^/inputs/' 'a link in the place of a model'
vain extract "{\"volume\":{\"href\":\"$THERE/subcortex.nii.gz\"},\"labels\":[77],\"smoothing\":-1}" '^/inputs/smoothing[^|]*$' 'a number out of range beside a volume'
vain distances "{\"surfaces\":[$L,7]}" '^/inputs/surfaces/1[^|]*$' 'a number in the place of a surface'
post_json /v1/processes/encode/execution "{\"inputs\":{\"mesh\":$L},\"nonsense\":1}"
is_problem 422 invalid-input 'a member of the body that is not known'
is "$(wc -l <"$SCRATCH/asked")" "$asked" 'nor then was anybody asked'
execute geodesic "{\"from\":$L,\"to\":{\"href\":\"$THERE/putamen.ply\"},\"steps\":3,\"register\":false}"
is "$STATUS" 200 'two links of one request are fetched'
execute mirror "{\"mesh\":$L}"
is "$STATUS" 200 'and that of a mesh in another process'
execute repair "{\"mesh\":$L}"
is "$STATUS" 200 'and that of one to be repaired'
like "$(grep link-failed "$SERVER_LOG" | head -n 1)" '"host":"127.0.0.1:' 'the log has the host'
unlike "$(cat "$SERVER_LOG")" 'thalamus' 'and no name'
get /v1/version
is "$STATUS" 200 'and the service goes on'
stop_server

# ---- A name that takes its time ------------------------------------------------------------------------------

# To look up slow.test takes 40 s, and nothing ends that: it is left behind.
serve_slow() { # ARGUMENTS..
    LD_PRELOAD=${SRNFD_BUILD:-build}/tests/names_shim.so start_server "$SCRATCH/data" --workers 1 \
        --link-prefixes "http://slow.test:$PORT/meshes/" --link-networks 127.0.0.0/8 "$@" || exit 1
}
begin_slow() {
    curl --silent "$@" "$URL/v1/processes/encode/execution" --header 'Content-Type: application/json' \
        --data "{\"inputs\":{\"mesh\":{\"href\":\"http://slow.test:$PORT/meshes/thalamus.ply\"}}}" >/dev/null
}
if [ -n "${SRNFD_SANITIZED:-}" ]; then
    skip 'names that are looked up slowly' 'the shim must be loaded first'
else
    serve_slow --link-seconds 2
    began=$(date +%s)
    refused "http://slow.test:$PORT/meshes/thalamus.ply" 422 link-failed 'link-seconds' 'a name that takes its time'
    compare $(($(date +%s) - began)) '<=' 8 'is given up with the seconds for links'
    stop_server || not_ok 'the server ends well'
    serve_slow --link-seconds 60 --grace-seconds 2
    began=$(date +%s)
    begin_slow --max-time 1
    for _ in $(seq 100); do
        grep -q '"event":"link-failed"' "$SERVER_LOG" && break
        sleep 0.1
    done
    check 'who hangs up ends it' grep -q '"event":"link-failed"' "$SERVER_LOG"
    compare $(($(date +%s) - began)) '<=' 8 'soon'
    begin_slow &
    sleep 0.5
    began=$(date +%s)
    stop_server || not_ok 'the server ends well'
    compare $(($(date +%s) - began)) '<=' 8 'and so does the end of the service'
fi

# ---- A job needs nobody else ---------------------------------------------------------------------------------

serve --link-seconds 60 --grace-seconds 20
curl --silent --max-time 1 "$URL/v1/processes/encode/execution" --header 'Content-Type: application/json' \
    --data "{\"inputs\":{\"mesh\":{\"href\":\"$THERE/slow\"}}}" >/dev/null
for _ in $(seq 100); do
    grep -q '"event":"link-failed"' "$SERVER_LOG" && break
    sleep 0.1
done
check 'who hangs up ends what is fetched' grep -q '"event":"link-failed"' "$SERVER_LOG"
execute encode "{\"mesh\":{\"href\":\"$THERE/putamen.ply\"},\"lmax\":40}" --header 'Prefer: respond-async'
is "$STATUS" 201 'a job of a link is accepted'
JOB=$(json .id)
get "/v1/jobs/$JOB"
like "$(json '.inputs.mesh | tojson')" 'mesh-' 'with what the link led to'
kill_server
kill "$SERVES"
start_server "$SCRATCH/data" --workers 1 || exit 1
for _ in $(seq 400); do
    get "/v1/jobs/$JOB"
    [ "$(json .status)" = accepted ] || [ "$(json .status)" = running ] || break
    sleep 0.1
done
is "$(json .status)" successful 'it ends after kill -9, without the other server and the setting'
stop_server || not_ok 'the server ends well'
done_testing
