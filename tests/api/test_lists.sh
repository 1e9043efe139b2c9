#!/usr/bin/env bash
# test_lists.sh - lists: found by name, tag, process, status, cohort, mesh and time, sorted, counted, and paged
# through in one order.
# srnfd-test: once (what is listed does not depend on the build)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
start_server "$DATA" --workers 1 || exit 1

names() {
    json '[.items[].name] | tojson'
}
patch() { # PATH JSON
    request PATCH "$1" --header 'Content-Type: application/json' --data-binary "$2"
}
found() { # PATH NAMES WHAT [CURL ARGUMENTS..]
    get "$1" "${@:4}"
    is "$(names) $(json .total)" "$2 $(jq length <<<"$2")" "$3"
}

declare -A MESH
for name in L_amygdala R_amygdala L_pallidum R_pallidum; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESH[$name]=$(json .id)
done
patch "/v1/meshes/${MESH[L_pallidum]}" '{"name":"Größe 50%","tags":["atlas","left"]}'
patch "/v1/meshes/${MESH[L_amygdala]}" '{"tags":["left"]}'
TIME=$(json .created)
post_json /v1/cohorts "{\"name\":\"pair\",\"members\":[{\"id\":\"${MESH[L_amygdala]}\"},{\"id\":\"${MESH[R_amygdala]}\"}]}"
post_json /v1/cohorts "{\"name\":\"Other\",\"members\":[{\"id\":\"${MESH[L_pallidum]}\"}]}"
for name in L_amygdala R_amygdala; do
    execute encode "{\"mesh\":\"${MESH[$name]}\",\"lmax\":5}"
    SURFACE=$(json .surface.id)
done
execute pca '{"cohort":"pair","register":false,"components":1,"lmax":5}'
MODEL=$(json .model.id)
is "$STATUS ${MODEL:0:6}" '200 model-' 'there is something to be listed'

# ---- Filters -------------------------------------------------------------------------------------------

found '/v1/meshes?name=AMYG&sort=name' '["L_amygdala","R_amygdala"]' 'part of a name, in any letters'
found '/v1/meshes?name=gr%C3%96SSE' '[]' 'of which one for two is none'
found '/v1/meshes?name=GR%C3%96%C3%9FE' '["Größe 50%"]' 'but other alphabets have small letters too'
found '/v1/meshes?name=GRO%CC%88%C3%9FE' '["Größe 50%"]' 'and letters with marks are one, as macOS writes them or not'
patch "/v1/meshes/${MESH[R_pallidum]}" "{\"name\":\"$(printf 'Mu\314\210ller')\"}"
found '/v1/meshes?name=M%C3%9CLL' "[\"$(printf 'Mu\314\210ller')\"]" 'in names too, which stay as they were given'
patch "/v1/meshes/${MESH[R_pallidum]}" '{"name":"R_pallidum"}'
found '/v1/meshes?name=0%25' '["Größe 50%"]' 'and % is a letter'
found '/v1/meshes?tag=left&sort=name' '["Größe 50%","L_amygdala"]' 'a tag'
is "$(json '[.items[].tags] | tojson')" '[["atlas","left"],["left"]]' 'which the list shows'
found '/v1/meshes?tag=left&name=amyg' '["L_amygdala"]' 'both at once'
found '/v1/meshes?tag=lef' '[]' 'a tag is the whole of it'
found '/v1/meshes?cohort=pair&sort=name' '["L_amygdala","R_amygdala"]' 'members of a cohort'
for list in meshes surfaces models jobs; do
    get "/v1/$list?cohort=nobody"
    is "$STATUS $(json '[.code, .errors[0].pointer] | tojson')" '422 ["invalid-input","/cohort"]' "$list of one that is not there are refused"
done
get "/v1/surfaces?mesh=${MESH[R_amygdala]}&process=encode"
is "$(json '[.items[].id, .total] | tojson')" "[\"$SURFACE\",1]" 'surfaces of a mesh'
get "/v1/models?cohort=pair"
is "$(json '[.items[].id] | tojson')" "[\"$MODEL\"]" 'models of a cohort'
get "/v1/models?process=encode"
is "$(json .total)" 0 'no process but their own has made them'
get "/v1/jobs?cohort=pair"
is "$(json '[.jobs[].processID] | tojson') $(json '.jobs[0].inputs.cohort.name')" '["pca"] pair' \
    'jobs of a cohort, with their inputs'
get "/v1/jobs?mesh=${MESH[L_amygdala]}&sort=process"
is "$(json '[.jobs[].processID] | tojson')" '["encode","pca"]' 'jobs that were given a mesh'
get "/v1/jobs?status=successful&process=encode"
is "$(json .total)" 2 'jobs by status and process'
found "/v1/cohorts?mesh=${MESH[L_amygdala]}" '["pair"]' 'cohorts with a mesh'
found '/v1/cohorts?name=OTH' '["Other"]' 'cohorts by name'
get "/v1/meshes?since=$TIME"
SINCE=$(json .total)
get "/v1/meshes?until=$TIME"
is "$((SINCE + $(json .total)))" 4 'since and until divide a list'
get '/v1/meshes?since=2001-01-01&until=2001-01-02T00:00:00%2B01:00'
is "$STATUS $(json .total)" '200 0' 'dates and zones are understood'

# ---- Order and pages -----------------------------------------------------------------------------------

found '/v1/meshes?sort=name' '["Größe 50%","L_amygdala","R_amygdala","R_pallidum"]' 'sorted by name'
found '/v1/meshes?sort=-name' '["R_pallidum","R_amygdala","L_amygdala","Größe 50%"]' 'and the other way'
found '/v1/meshes?sort=created' '["L_amygdala","R_amygdala","Größe 50%","R_pallidum"]' 'the oldest first'
found '/v1/cohorts?sort=name' '["Other","pair"]' 'cohorts too, in any letters'
for sort in name -name created -created; do
    paged=() next="/v1/meshes?sort=$sort&limit=1&name=_"
    get "/v1/meshes?sort=$sort&name=_"
    whole=$(names)
    while [ -n "$next" ]; do
        get "$next"
        paged+=("$(json '.items[0].name')")
        [ "$(json .total)" = 3 ] || not_ok 'each page has the total' "$(json .total)"
        next=$(header Link | sed -n 's/.*<\(.*\)>; rel="next"/\1/p')
    done
    is "$(jq -nc '$ARGS.positional' --args "${paged[@]}")" "$whole" "page by page it is the same, by $sort"
done
post "/v1/meshes?name=$(printf '%%F0%%9F%%90%%98%.0s' $(seq 255))" --data-binary @tests/data/aal_subcortex/L_caudate.ply
get '/v1/meshes?sort=-name&limit=1'
CURSOR=$(json .next)
get "/v1/meshes?sort=-name&limit=1&cursor=$CURSOR"
is "$STATUS $(json '.items[0].name')" '200 R_pallidum' 'a cursor holds the longest name'

# ---- Refusals ------------------------------------------------------------------------------------------

wrong() { # QUERY POINTER DETAIL WHAT
    get "/v1/$1"
    is_problem 422 invalid-input "$4"
    like "$(json '.errors[] | .pointer + " " + .detail')" "^$2 .*$3" "$4: with the reason"
}
wrong "meshes?sort=name&cursor=$CURSOR" /cursor 'sort=-name' 'a cursor of another order'
wrong 'meshes?sort=naem' /sort 'did you mean name\? Known: created, name, process' 'an unknown order'
wrong 'jobs?status=succesful' /status 'did you mean successful\?' 'an unknown status'
wrong 'jobs?process=encod' /process 'did you mean encode\?' 'an unknown process'
wrong 'jobs?mesh=surf-00000000000000000000000000000000' /mesh 'id of a mesh' 'a surface as a mesh'
wrong 'meshes?cohort=a/b' /cohort 'name of a cohort' 'no name of a cohort'
wrong 'meshes?since=yesterday' /since 'RFC 3339' 'no time'
wrong 'meshes?since=2026-02-30' /since 'RFC 3339' 'no day'
wrong 'meshes?since=2026-01-02&until=2026-01-01' /until 'later than since' 'times that exclude each other'
wrong 'meshes?tag=' /tag 'empty' 'an empty tag'
get "/v1/meshes?tag=$(printf '%065d' 0)"
is_problem 400 malformed-request 'a tag that is too long'
like "$(json .detail)" 'parameter tag .* 64 bytes' 'whose limit is told'
wrong 'meshes?name=%FF' /name 'UTF-8' 'a name that is no text'
get '/v1/meshes?status=running'
is_problem 400 unknown-parameter 'meshes have no status'
like "$(json .detail)" 'known: limit,cursor,sort,name,since,until,tag,process,cohort,mesh' 'and the known are told'
get '/v1/volumes?mesh=x'
is_problem 400 unknown-parameter 'volumes are made of no mesh'
if stop_server; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi

# ---- Owners --------------------------------------------------------------------------------------------

ADA=$("$SRNFD" token add --data "$DATA" --name ada 2>/dev/null)
ADMIN=$("$SRNFD" token add --data "$DATA" --name admin --role admin 2>/dev/null)
start_server "$DATA" --workers 1 || exit 1
as() { # TOKEN COMMAND..
    local secret=$1
    shift
    "$@" --header "Authorization: Bearer $secret"
}
as "$ADA" post '/v1/meshes?name=hers' --data-binary @tests/data/aal_subcortex/L_amygdala.ply
as "$ADA" found '/v1/meshes' '["hers"]' 'an owner lists the own'
as "$ADA" found '/v1/meshes?tag=left' '[]' 'and finds nothing by what others call it'
as "$ADA" found "/v1/surfaces?mesh=${MESH[L_amygdala]}" '[]' 'nor what they made of it'
as "$ADA" get '/v1/meshes?cohort=pair'
is "$STATUS $(json '.errors[0].pointer')" '422 /cohort' 'nor by their cohorts'
as "$ADMIN" found '/v1/meshes?name=amyg&sort=name' '["L_amygdala","R_amygdala"]' 'an admin all, as the first owner calls it'
if stop_server; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing
