#!/usr/bin/env bash
# test_encode_cohort.sh - encode of a cohort: one job, a row for each member with its surface or its problem, as JSON and
# as CSV; and the job goes on where it was when the daemon died.
# srnfd-test: slow
# srnfd-test: no-asan (api/test_standard.sh and api/test_imports.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400

run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}

start_server "$SCRATCH/data" --workers 2 || exit 1

MESH=()
for name in L_caudate R_caudate L_putamen; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESH+=("$(json .id)")
done
printf 'OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n' >"$SCRATCH/open.off"
post '/v1/meshes?name=open' --data-binary "@$SCRATCH/open.off"
OPEN=$(json .id)
run encode "{\"mesh\":\"${MESH[2]}\",\"lmax\":6}"
GIVEN=$(json .surface.id)

post_json /v1/cohorts "{\"name\":\"all\",\"members\":[{\"id\":\"${MESH[0]}\",\"label\":\"L\",\"subject\":\"s 1, a\"},
    {\"id\":\"${MESH[1]}\",\"label\":\"R\",\"mirror\":true},{\"id\":\"$OPEN\"},{\"id\":\"$GIVEN\"}]}"
is "$STATUS" 201 'a cohort of meshes, one of them open, and a surface'
run encode '{"cohort":"all","lmax":8}'
is "$STATUS $(json '[.cohort, .encoded, .failed, (.rows | length)] | tojson')" '200 ["all",2,1,4]' 'is encoded in one job'
is "$(json '[.rows[] | .problem.code] | tojson')" '[null,null,"mesh-not-closed",null]' 'a mesh that cannot be has a problem in its row'
is "$(json '[.rows[] | .encoded] | tojson')" '[true,true,true,false]' 'and a surface is taken as it is'
is "$(json '.rows | [.[0].label, .[0].subject, .[1].mirrored, .[2].surface, .[3].surface] | tojson')" \
    "[\"L\",\"s 1, a\",true,null,\"$GIVEN\"]" 'rows say whose they are'
FIRST=$(json '.rows[0].surface')
SECOND=$(json '.rows[1].surface')
compare "$(json '.rows[0].fit.rms')" '<' 1 'with the fit (millimetres)'
run encode "{\"mesh\":\"${MESH[0]}\",\"lmax\":8}"
is "$(json .surface.id)" "$FIRST" 'they are the surfaces that the meshes have by themselves'
run encode "{\"mesh\":\"${MESH[1]}\",\"lmax\":8,\"mirror\":true}"
is "$(json .surface.id)" "$SECOND" 'and mirrored'
get "/v1/surfaces/$SECOND"
is "$STATUS $(json '[.name, .mirrored, .lmax] | tojson')" '200 ["R_caudate",true,8]' 'under the names of their meshes'

execute encode '{"cohort":"all","lmax":8}'
JOB=$(basename "$(header Link | sed -n 's/.*<\([^>]*\)>; rel="monitor".*/\1/p')")
get "/v1/jobs/$JOB/results?format=csv"
is "$STATUS $(head -n 1 "$BODY" | tr -d '\r')" \
    '200 member,id,label,subject,surface,route,mirrored,lmax,scale,area,volume,fitRms,fitMax,problem,detail' \
    'the rows are a table too'
is "$(wc -l <"$BODY")" 5 'of one line for each member'
like "$(sed -n 2p "$BODY")" "^0,${MESH[0]},L,\"s 1, a\",$FIRST,area,false,8," 'with what the row says'
like "$(sed -n 4p "$BODY")" ',mesh-not-closed,' 'or its problem'
get "/v1/jobs/$JOB/results?format=npy"
is "$STATUS" 406 'but no array'

post_json /v1/cohorts "{\"name\":\"none\",\"members\":[{\"id\":\"$OPEN\"},{\"id\":\"$GIVEN\"}]}"
execute encode '{"cohort":"none"}' --header 'Prefer: wait=60'
is "$STATUS $(json .code)" '422 mesh-not-closed' 'where none is left, the job fails'
like "$(json .detail)" 'Of the 2 members none could be encoded' 'and says so'

# ---- Refusals ----------------------------------------------------------------------------------------

refused() { # INPUTS POINTER NAME
    run encode "$1"
    is "$STATUS $(json '.errors[0].pointer')" "422 $2" "$3"
}
refused '{}' /inputs/mesh 'something must be given'
refused "{\"cohort\":\"all\",\"mesh\":\"${MESH[0]}\"}" /inputs/mesh 'and not both'
refused "{\"cohort\":\"all\",\"center\":[0,0,0]}" /inputs/center 'a centre is for one mesh'
refused "{\"cohort\":\"all\",\"parameterization\":\"given\"}" /inputs/parameterization 'a sphere is for one mesh'
refused "{\"cohort\":\"all\",\"sphere\":\"${MESH[0]}\"}" /inputs/sphere 'whatever the parameterization'
post_json /v1/cohorts "{\"name\":\"surfaces\",\"members\":[{\"id\":\"$GIVEN\"}]}"
refused '{"cohort":"surfaces"}' /inputs/cohort 'surfaces are encoded'
run encode '{"cohort":"nobody"}'
is "$STATUS $(json .code)" '404 no-such-cohort' 'the cohort must be there'

# ---- The daemon dies ---------------------------------------------------------------------------------

members=()
for i in $(seq 40); do
    awk -v s="1.$(printf %02d "$i")" '/^v /{ printf "v %.9g %.9g %.9g\n", $2 * s, $3, $4; next } { print }' \
        <(curl -fsS "$URL/v1/meshes/${MESH[0]}/content?format=obj") >"$SCRATCH/one.obj"
    post "/v1/meshes?name=m$i" --data-binary "@$SCRATCH/one.obj"
    members+=("{\"id\":\"$(json .id)\"}")
done
post_json /v1/cohorts "{\"name\":\"many\",\"members\":[$(
    IFS=,
    echo "${members[*]}"
)]}"
is "$STATUS" 201 'a cohort of forty'
execute encode '{"cohort":"many","lmax":12}' --header 'Prefer: respond-async'
JOB=$(json .id)
for _ in $(seq 3000); do
    get "/v1/jobs/$JOB"
    case $(json .status) in accepted | running) ;; *) break ;; esac
    [ "$(json '.progress // 0 | floor')" -lt 50 ] || break
    sleep 0.05
done
note "killed while $(json .status), at $(json .progress) %"
kill_server "$SERVER_PID"
start_server "$SCRATCH/data" --workers 2 || exit 1
poll_job "$JOB" 300 || not_ok 'the job ends'
get "/v1/jobs/$JOB/results"
is "$STATUS $(json '[.encoded, .failed, ([.rows[].surface] | unique | length), ([.rows[].member] == [range(40)])] | tojson')" \
    '200 [40,0,40,true]' 'the job goes on where the daemon died'
SURFACES=$(json '[.rows[].surface] | tojson')
run encode '{"cohort":"many","lmax":12,"smoothing":0}'
is "$(json '[.rows[].surface] | tojson')" "$SURFACES" 'and has what it would have had'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing
