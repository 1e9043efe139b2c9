#!/usr/bin/env bash
# test_preconditions.sh - If-Match and If-None-Match of requests that change something: 412 before the change
# (RFC 9110, 13.2.2), for everything that has an entity tag.
# srnfd-test: once (what is changed does not depend on the build)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1

patch() { # PATH JSON [CURL ARGUMENTS..]
    local path=$1 document=$2
    shift 2
    request PATCH "$path" --header 'Content-Type: application/merge-patch+json' --data-binary "$document" "$@"
}
tag_of() { # PATH
    get "$1"
    header ETag
}

post '/v1/meshes?name=left' --data-binary @tests/data/aal_subcortex/L_amygdala.ply
MESH=$(json .id)
post '/v1/volumes?name=AAL' --data-binary @tests/data/aal_volume/subcortex.nii.gz
VOLUME=$(json .id)
execute encode "{\"mesh\":\"$MESH\",\"lmax\":7}"
SURFACE=$(json .surface.id)
execute encode "{\"mesh\":\"$MESH\",\"lmax\":8}"
execute pca "{\"surfaces\":[\"$SURFACE\",\"$(json .surface.id)\",\"$MESH\"],\"register\":false,\"components\":1}"
MODEL=$(json .model.id)
get '/v1/jobs?process=encode&limit=1'
JOB=$(json '.jobs[0].id')

for path in "models/$MODEL" "surfaces/$SURFACE" "volumes/$VOLUME" "meshes/$MESH" "jobs/$JOB"; do
    kind=${path%%/*}
    first=$(tag_of "/v1/$path")
    isnt "$first" '' "$kind: the record has an entity tag"
    is "$STATUS" 200 "$kind: and is there"
    get "/v1/$path" --header "If-None-Match: $first"
    is "$STATUS" 304 "$kind: a GET that names it is 304"
    get "/v1/$path" --header 'If-None-Match: "other"' --header "If-None-Match: $first"
    is "$STATUS" 304 "$kind: in whichever of two fields, as a list may come in parts"
    get "/v1/$path" --header 'If-Match: "other"'
    is_problem 412 precondition-failed "$kind: a GET of what is not there any more is 412"
    is "$(header Cache-Control)" '' "$kind: which nobody keeps"
    request HEAD "/v1/$path" --header 'If-Match: "other"'
    is "$STATUS" 412 "$kind: HEAD, too"
    get "/v1/$path" --header 'If-Match: "other"' --header "If-Match: $first"
    is "$STATUS" 200 "$kind: a GET of what is there is answered"
    get "/v1/$path" --header 'If-Match: *'
    is "$STATUS" 200 "$kind: and of whatever is there"
    conditions=('If-None-Match: *' 'If-Match: "other"')
    [ "$kind" != meshes ] || conditions+=("If-None-Match: $first" "If-None-Match: \"x\", W/$first")
    for condition in "${conditions[@]}"; do
        patch "/v1/$path" '{"name":"changed"}' --header "$condition"
        is_problem 412 precondition-failed "$kind: PATCH with $condition"
        request DELETE "/v1/$path?_=1" --header "$condition"
        is_problem 412 precondition-failed "$kind: DELETE with it"
    done
    is "$(tag_of "/v1/$path")" "$first" "$kind: nothing was changed"
    patch "/v1/$path" '{"name":"once"}' --header "If-Match: \"x\", $first" --header 'If-None-Match: "y"'
    is "$STATUS $(json .name)" '200 once' "$kind: PATCH of what the caller has seen"
    second=$(header ETag)
    is "$second" "$(tag_of "/v1/$path")" "$kind: the answer has the new tag"
    patch "/v1/$path" '{"name":"twice"}' --header "If-Match: $first"
    is_problem 412 precondition-failed "$kind: who has seen an older one does not undo it"
    patch "/v1/$path" '{"name":"starred"}' --header 'If-Match: *'
    is "$STATUS $(json .name)" '200 starred' "$kind: any will do"
done
get "/v1/models/$MODEL"
is "$(json .name)" starred 'nothing but what was allowed was changed'

# ---- Removing ------------------------------------------------------------------------------------------

old=$(tag_of "/v1/volumes/$VOLUME")
patch "/v1/volumes/$VOLUME" '{"tags":["kept"]}'
request DELETE "/v1/volumes/$VOLUME" --header "If-Match: $old"
is_problem 412 precondition-failed 'what has been changed since is not removed'
request DELETE "/v1/volumes/$VOLUME" --header "If-Match: $(tag_of "/v1/volumes/$VOLUME")"
is "$STATUS" 204 'what has not is'
request DELETE "/v1/volumes/$VOLUME" --header 'If-Match: *'
is_problem 404 no-such-volume 'what is not there is 404, whatever the condition'
request DELETE "/v1/jobs/$JOB" --header "If-Match: $(tag_of "/v1/jobs/$JOB")"
is "$STATUS" 200 'a job that ended is removed as it was seen'

# ---- A job that has not ended changes by the moment, and has no tag ------------------------------------

post_json /v1/processes/distances/execution \
    "{\"inputs\":{\"surfaces\":[\"$SURFACE\",\"$MESH\",\"$(json .id)\"],\"register\":true}}" --header 'Prefer: respond-async'
post '/v1/meshes?name=right' --data-binary @tests/data/aal_subcortex/R_amygdala.ply
OTHER=$(json .id)
post_json /v1/processes/mean/execution \
    "{\"inputs\":{\"surfaces\":[\"$MESH\",\"$OTHER\"],\"lmax\":63}}" --header 'Prefer: respond-async'
JOB=$(json .id)
get "/v1/jobs/$JOB"
case $(json .status) in
accepted | running)
    is "$(header ETag)" '' 'a job that has not ended has no tag'
    patch "/v1/jobs/$JOB" '{"name":"x"}' --header 'If-Match: "x"'
    is_problem 412 precondition-failed 'so no tag fits it'
    patch "/v1/jobs/$JOB" '{"name":"x"}' --header 'If-None-Match: *'
    is_problem 412 precondition-failed 'but it is there'
    patch "/v1/jobs/$JOB" '{"name":"x"}' --header 'If-Match: *'
    is "$STATUS" 200 'and can be changed as that'
    request DELETE "/v1/jobs/$JOB" --header 'If-Match: "x"'
    is_problem 412 precondition-failed 'a condition that fails leaves it running'
    request DELETE "/v1/jobs/$JOB" --header 'If-Match: *'
    is "$STATUS $(json .status)" '200 dismissed' 'one that holds does not'
    ;;
*) not_ok 'a mean of degree 63 takes longer than a request' ;;
esac

# ---- Cohorts -------------------------------------------------------------------------------------------

post_json /v1/cohorts "{\"name\":\"pair\",\"members\":[{\"id\":\"$MESH\"},{\"id\":\"$OTHER\"}]}"
tag=$(tag_of /v1/cohorts/pair)
for condition in 'If-None-Match: *' "If-None-Match: $tag"; do
    patch /v1/cohorts/pair '{"name":"other"}' --header "$condition"
    is_problem 412 precondition-failed "a cohort: PATCH with $condition"
    request PUT /v1/cohorts/pair/members --header 'Content-Type: application/json' --header "$condition" \
        --data-binary "{\"members\":[{\"id\":\"$MESH\"}]}"
    is_problem 412 precondition-failed 'PUT of its members'
    request DELETE /v1/cohorts/pair --header "$condition"
    is_problem 412 precondition-failed 'DELETE'
done
is "$(tag_of /v1/cohorts/pair)" "$tag" 'the cohort is as it was'

# ---- Whose it is ---------------------------------------------------------------------------------------

stop_server
ADA=$("$SRNFD" token add --data "$SCRATCH/data" --name ada 2>/dev/null)
ADMIN=$("$SRNFD" token add --data "$SCRATCH/data" --name root --role admin 2>/dev/null)
start_server "$SCRATCH/data" --workers 1 || exit 1
post '/v1/meshes?name=hers' --header "Authorization: Bearer $ADA" --data-binary @tests/data/aal_subcortex/L_pallidum.ply
MESH=$(json .id)
get "/v1/meshes/$MESH" --header "Authorization: Bearer $ADA"
tag=$(header ETag)
patch "/v1/meshes/$MESH?owner=ada" '{"name":"theirs"}' --header "Authorization: Bearer $ADMIN" --header 'If-Match: "x"'
is_problem 412 precondition-failed "an administrator's condition is on the owner's record"
patch "/v1/meshes/$MESH?owner=ada" '{"name":"theirs"}' --header "Authorization: Bearer $ADMIN" --header "If-Match: $tag"
is "$STATUS" 200 'and holds if the tag is that'

stop_server
done_testing
