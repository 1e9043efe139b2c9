#!/usr/bin/env bash
# test_cohorts.sh - cohorts as resources: made, read, listed and removed; what is refused, and why.
# srnfd-test: once (what is refused does not depend on the build)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1

post '/v1/meshes?name=left' --data-binary @tests/data/aal_subcortex/L_pallidum.ply
MESH=$(json .id)
execute encode "{\"mesh\":\"$MESH\",\"lmax\":4}"
SURFACE=$(json .surface.id)
ABSENT=surf-00000000000000000000000000000000
MEMBERS="[{\"id\":\"$SURFACE\",\"label\":\"left, \\\"best\\\"\",\"covariates\":{\"age\":41.5,\"sex\":\"f\"}},{\"id\":\"$MESH\",\"subject\":\"s2\"}]"

# ---- Making and reading ------------------------------------------------------------------------------

post_json /v1/cohorts "{\"name\":\"study.1\",\"members\":$MEMBERS}"
is "$STATUS $(header Location)" '201 /v1/cohorts/study.1' 'a cohort is made'
is "$(json '[.memberCount, .members[0].id, .members[1].id] | tojson')" "[2,\"$SURFACE\",\"$MESH\"]" \
    'its members are in order'
is "$(json_in_order '.members[0].covariates | tojson')" '{"age":41.5,"sex":"f"}' 'with their covariates'
is "$(json '.members[1] | [.label, .subject, .covariates] | tojson')" '[null,"s2",{}]' \
    'and what was left out is null or empty'
post_json /v1/cohorts "{\"name\":\"empty\",\"members\":[{\"id\":\"$MESH\",\"label\":\"\",\"subject\":\" \",\"covariates\":{\"site\":\"\",\"age\":\" \\t\"}}]}"
is "$STATUS $(json '.members[0] | [.label, .subject, .covariates] | tojson')" '201 [null,null,{"age":null,"site":null}]' \
    'an empty text says nothing, as an empty cell of a table'
request DELETE /v1/cohorts/empty
post_json /v1/cohorts "{\"members\":$(jq -c 'map(.label = (.label // null))' <<<"$MEMBERS"),\"name\":\"study.1\"}"
is "$STATUS" 200 'the same content in another spelling is the same cohort'
post_json /v1/cohorts "{\"name\":\"study.1\",\"members\":[{\"id\":\"$MESH\"}]}"
is_problem 409 cohort-exists 'another content under its name is refused'
like "$(json .detail)" 'PATCH /v1/cohorts/[^ ]+, replace its members by PUT' 'with the ways to change it'
get /v1/cohorts/study.1
is "$STATUS $(json '"\(.name) \(.memberCount) \(.links.self)"')" '200 study.1 2 /v1/cohorts/study.1' 'it is read back'
get /v1/cohorts/study.1 --header "If-None-Match: $(header ETag)"
is "$STATUS" 304 'and has an entity tag'

LONG=$(printf 'x%.0s' $(seq 100))
for name in b c "$LONG"; do
    post_json /v1/cohorts "{\"name\":\"$name\",\"members\":[{\"id\":\"$MESH\"}]}"
done
get '/v1/cohorts?limit=1'
is "$(json '.items | map(.name) | join(" ")')" "$LONG" 'the list begins with the newest'
FIRST=$(json '.next')
get "/v1/cohorts?limit=200&cursor=$FIRST"
is "$(json '.items | map(.name) | join(" ")') $(json '.items[0] | has("members")')" 'c b study.1 false' \
    'and goes on after a name of a hundred characters'

# ---- Refusals ----------------------------------------------------------------------------------------

wrong() { # JSON POINTER WHAT
    post_json /v1/cohorts "$1"
    if [ "$STATUS $(json .code)" = '422 invalid-input' ] &&
        jq -e --arg p "$2" 'any(.errors[]; .pointer == $p)' "$BODY" >/dev/null; then
        ok "refused with its pointer: $3"
    else
        not_ok "refused with its pointer: $3" "$STATUS $(head -c 300 "$BODY")"
    fi
}
one="[{\"id\":\"$MESH\"}]"
wrong "{\"name\":\"d\",\"members\":[{\"id\":\"$MESH\"},{\"id\":\"$ABSENT\"}]}" /members/1/id 'a member that does not exist'
get /v1/cohorts/d
is_problem 404 no-such-cohort 'which leaves nothing behind'
wrong "{\"name\":\"a b\",\"members\":$one}" /name 'a name with a space'
wrong "{\"name\":\"..\",\"members\":$one}" /name 'a name that means a folder'
wrong "{\"name\":\"x$LONG\",\"members\":$one}" /name 'a name that is too long'
wrong "{\"members\":$one}" /name 'no name'
wrong '{"name":"d"}' /members 'no members'
wrong '{"name":"d","members":[]}' /members 'an empty list of members'
wrong '{"name":"d","members":[7]}' /members/0 'a member that is no object'
wrong '{"name":"d","members":[{"id":"job-1"}]}' /members/0/id 'an id of another kind'
wrong "{\"name\":\"d\",\"more\":1,\"members\":$one}" /more 'an unknown member of the body'
wrong "{\"name\":\"d\",\"members\":[{\"id\":\"$MESH\",\"age\":3}]}" /members/0/age 'an unknown member of a member'
wrong "{\"name\":\"d\",\"members\":[{\"id\":\"$MESH\",\"label\":3}]}" /members/0/label 'a label that is no text'
wrong "{\"name\":\"d\",\"members\":[{\"id\":\"$MESH\",\"covariates\":{\"a\":[1]}}]}" /members/0/covariates/a \
    'a covariate that is a list'

# ---- Using and removing ------------------------------------------------------------------------------

post_json /v1/cohorts "{\"name\":\"pair\",\"members\":[{\"id\":\"$SURFACE\",\"label\":\"a,b\"},{\"id\":\"$SURFACE\"}]}"
execute distances '{"cohort":"pair","register":false}'
is "$STATUS $(json '[.labels, .groups, .matrix] | tojson')" \
    "200 [[\"left ($SURFACE) #0\",\"left ($SURFACE) #1\"],[\"a,b\",null],[[0,0],[0,0]]]" \
    'a process takes it, names its members so that no two are the same, and tells their labels'
post_json /v1/cohorts "{\"name\":\"named\",\"members\":[{\"id\":\"$SURFACE\",\"label\":\"ctl\",\"subject\":\"a,b\"},{\"id\":\"$SURFACE\",\"label\":\"ctl\"}]}"
execute distances '{"cohort":"named","register":false}'
is "$(json '[.labels, .groups] | tojson')" '[["a,b","left"],["ctl","ctl"]]' 'by subject, or else by name'
get '/v1/jobs?process=distances&limit=1'
JOB=$(json '.jobs[0].id')
get "/v1/jobs/$JOB/results" --header 'Accept: text/csv'
is "$STATUS $(tr -d '\r' <"$BODY" | paste -sd '|')" "200 label,subject,id,\"a,b\",left|\"a,b\",\"a,b\",$SURFACE,0,0|left,,$SURFACE,0,0" \
    'the matrix comes as CSV, with subjects and ids'
like "$(header Content-Type)" '^text/csv' 'which its type says'
get "/v1/jobs/$JOB/results?format=npy"
is "$STATUS $(wc -c <"$BODY")" '200 160' 'and as .npy'
get "/v1/jobs/$JOB/results?format=npy&condensed=true"
like "$STATUS $(head -c 128 "$BODY" | tr -d '\0')" "^200 .*'shape': \(1,\)" 'which is half as long condensed'
is "$(wc -c <"$BODY")" 136 'one number for two members'
get "/v1/jobs/$JOB/results?format=csv&condensed=true"
is_problem 422 invalid-input 'other forms are not'
get "/v1/jobs/$JOB/results?format=npy&condensed=1"
is_problem 422 invalid-input 'and it is true or false'
get "/v1/jobs/$JOB/results?format=xls"
is_problem 422 invalid-input 'in no other form'
get '/v1/jobs?process=encode&limit=1'
get "/v1/jobs/$(json '.jobs[0].id')/results?format=csv"
is_problem 406 not-acceptable 'and other results not at all'

get /v1/cohorts/pair
TAG=$(header ETag)
request DELETE /v1/cohorts/pair --header 'If-Match: "nope"'
is_problem 412 precondition-failed 'a cohort that is not the one of If-Match stays'
get /v1/cohorts/pair
is "$STATUS" 200 'as it was'
request DELETE /v1/cohorts/pair --header "If-Match: \"nope\", $TAG"
is "$STATUS" 204 'a cohort is removed'
request DELETE /v1/cohorts/pair
is_problem 404 no-such-cohort 'once'
execute mean '{"cohort":"pair"}'
is_problem 404 no-such-cohort 'and is no input any more'
get "/v1/surfaces/$SURFACE"
is "$STATUS" 200 'what it named stays'
post_json /v1/cohorts "{\"name\":\"pair\",\"members\":$one}"
is "$STATUS" 201 'and its name is free'

if stop_server "$SERVER_PID"; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
done_testing
