#!/usr/bin/env bash
# test_names.sh - names and tags of meshes, volumes, surfaces, models and jobs: given, changed, taken away, each owner's own.
# srnfd-test: once (names and tags do not depend on the build)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
start_server "$DATA" --workers 1 || exit 1

patch() { # PATH JSON [CURL ARGUMENTS..]
    local path=$1 document=$2
    shift 2
    request PATCH "$path" --header 'Content-Type: application/merge-patch+json' --data-binary "$document" "$@"
}
labels() {
    json '[.name, .tags] | tojson'
}

post '/v1/meshes?name=left' --data-binary @tests/data/aal_subcortex/L_amygdala.ply
MESH=$(json .id)
is "$(labels)" '["left",[]]' 'a mesh has the name that it came with, and no tags'
execute encode "{\"mesh\":\"$MESH\",\"lmax\":7}"
SURFACE=$(json .surface.id)
execute encode "{\"mesh\":\"$MESH\",\"lmax\":8}"
OTHER=$(json .surface.id)
execute pca "{\"surfaces\":[\"$SURFACE\",\"$OTHER\",\"$MESH\"],\"register\":false,\"components\":1}"
MODEL=$(json .model.id)
get '/v1/jobs?process=pca'
JOB=$(json '.jobs[0].id')

# ---- Changing ----------------------------------------------------------------------------------------

post '/v1/volumes?name=AAL' --data-binary @tests/data/aal_volume/subcortex.nii.gz
VOLUME=$(json .id)
for path in "meshes/$MESH" "volumes/$VOLUME" "surfaces/$SURFACE" "models/$MODEL" "jobs/$JOB"; do
    kind=${path%%/*}
    get "/v1/$path"
    before=$(labels)
    tag=$(header ETag)
    patch "/v1/$path" '{"name":"Ä new \"name\"","tags":["b","a","b"]}'
    is "$STATUS $(labels)" '200 ["Ä new \"name\"",["b","a"]]' "$kind: name and tags are set, each tag once"
    get "/v1/$path" --header "If-None-Match: ${tag:-none}"
    is "$STATUS $(labels)" '200 ["Ä new \"name\"",["b","a"]]' "$kind: for good, and under another entity tag"
    patch "/v1/$path" '{"tags":null}'
    is "$(labels)" '["Ä new \"name\"",[]]' "$kind: null removes, and what is not given stays"
    patch "/v1/$path" '{"name":null}'
    is "$(labels)" '["",[]]' "$kind: the name too"
    request PATCH "/v1/$path" --header 'Content-Type: application/json' --data-binary "{\"name\":$(jq -c '.[0]' <<<"$before")}"
    is "$(labels)" "$before" "$kind: and back, as plain JSON"
done
get "/v1/jobs/$JOB"
is "$(json '[.inputs.surfaces, .inputs.register] | tojson')" "[[\"$SURFACE\",\"$OTHER\",\"$MESH\"],false]" \
    'the record of a job has its inputs'
get /v1/jobs?process=pca
is "$(json '.jobs[0].inputs.surfaces | tojson')" "[\"$SURFACE\",\"$OTHER\",\"$MESH\"]" 'and its entry in a list too'

# ---- Other ways --------------------------------------------------------------------------------------

post '/v1/meshes?name=again' --data-binary @tests/data/aal_subcortex/L_amygdala.ply
is "$STATUS $(json .id) $(json .name)" "200 $MESH again" 'a mesh sent again with a name takes it'
post '/v1/meshes' --data-binary @tests/data/aal_subcortex/L_amygdala.ply
is "$STATUS $(json .name)" '200 again' 'and without one keeps its own'
post_json /v1/processes/encode/execution "{\"inputs\":{\"mesh\":\"$MESH\",\"lmax\":9},\"name\":\"first\",\"tags\":[\"x\"]}" \
    --header 'Prefer: respond-async'
is "$STATUS $(labels)" '201 ["first",["x"]]' 'an execution gives its job a name and tags'
JOB=$(json .id)
poll_job "$JOB" 60
post_json /v1/processes/encode/execution "{\"inputs\":{\"mesh\":\"$MESH\",\"lmax\":9},\"name\":\"second\"}"
is "$STATUS $(header Cache-Status)" '200 srnfd; hit' 'they are no part of what it computes'
get "/v1/jobs/$JOB"
is "$(labels)" '["second",["x"]]' 'and a job that has the answer already takes them'

# ---- Refusals ----------------------------------------------------------------------------------------

wrong() { # JSON POINTER WHAT
    patch "/v1/meshes/$MESH" "$1"
    if [ "$STATUS $(json .code)" = '422 invalid-input' ] &&
        jq -e --arg p "$2" 'any(.errors[]; .pointer == $p)' "$BODY" >/dev/null; then
        ok "refused with its pointer: $3"
    else
        not_ok "refused with its pointer: $3" "$STATUS $(head -c 300 "$BODY")"
    fi
}
wrong '{"name":7}' /name 'a name that is no text'
wrong '{"name":"a\nb"}' /name 'one with a line break'
wrong "{\"name\":\"$(printf 'x%.0s' $(seq 256))\"}" /name 'one of 256 characters'
wrong '{"tags":"a"}' /tags 'tags that are no array'
wrong "{\"tags\":[$(seq -s, 65 | sed 's/[0-9]*/"&"/g')]}" /tags '65 tags'
wrong '{"tags":["a",7]}' /tags/1 'a tag that is no text'
wrong '{"tags":[""]}' /tags/0 'an empty one'
wrong "{\"tags\":[\"$(printf 'x%.0s' $(seq 65))\"]}" /tags/0 'one of 65 bytes'
wrong '{"format":"obj"}' /format 'another member'
patch /v1/meshes/mesh-00000000000000000000000000000000 '{"name":"x"}'
is_problem 404 no-such-mesh 'a mesh that is not there'
patch "/v1/meshes/$SURFACE" '{"name":"x"}'
is_problem 404 no-such-mesh 'a surface is no mesh'
request PATCH "/v1/meshes/$MESH" --header 'Content-Type: text/plain' --data-binary '{"name":"x"}'
is_problem 415 unsupported-media-type 'a body of another type'
post_json /v1/processes/encode/execution "{\"inputs\":{\"mesh\":\"$MESH\"},\"tags\":[1]}"
is_problem 422 invalid-input 'wrong tags of an execution'
get "/v1/meshes/$MESH"
is "$(labels)" '["again",[]]' 'nothing of that changed anything'
if stop_server; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi

# ---- Owners ------------------------------------------------------------------------------------------

DATA=$SCRATCH/owned
mkdir "$DATA" && chmod 700 "$DATA"
token() { # NAME [ARGUMENTS]
    local name=$1
    shift
    "$SRNFD" token add --data "$DATA" --name "$name" "$@" 2>/dev/null
}
as() { # TOKEN COMMAND..
    local secret=$1
    shift
    "$@" --header "Authorization: Bearer $secret"
}
ADA=$(token ada --role user)
BEN=$(token ben --role user --max-bytes 40000)
start_server "$DATA" --workers 1 || exit 1
for who in "$ADA" "$BEN"; do
    as "$who" post '/v1/meshes?name=same' --data-binary @tests/data/aal_subcortex/L_amygdala.ply
done
as "$ADA" patch "/v1/meshes/$MESH" '{"name":"hers","tags":["whisper"]}'
as "$BEN" get "/v1/meshes/$MESH"
is "$(labels)" '["same",[]]' 'what one owner calls it, the other does not see'
as "$BEN" patch "/v1/meshes/$MESH" "{\"tags\":[$(seq -s, 64 | sed 's/[0-9]*/"&"/g')]}"
is_problem 507 storage-quota-exceeded 'tags count in the quota'
as "$ADA" request DELETE "/v1/meshes/$MESH"
as "$BEN" request DELETE "/v1/meshes/$MESH"
is "$(sqlite3 -readonly "$DATA/srnfd.db" 'SELECT sum(bytes) FROM owner; SELECT count(*) FROM tag' | paste -sd ' ')" '0 0' \
    'and go with what they name'
is "$(grep -rlaF -e whisper "$DATA/srnfd.db" "$DATA"/srnfd.db-wal)" '' 'for good'
if stop_server; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
check 'the check finds nothing wrong' "$SRNFD" check --data "$DATA"
done_testing
