#!/usr/bin/env bash
# What results and problems say: the mesh and the name asked for stand in the results, records keep their order,
# details are said once and in the client's words, names and whole numbers of the query are strict.
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1
THALAMUS=tests/data/aal_subcortex/L_thalamus.ply

# ---- The same geometry under two ids -------------------------------------------------------------------

post '/v1/meshes?name=first' --data-binary "@$THALAMUS"
first=$(json .id)
sed '0,/^end_header/s/^end_header/comment another file\nend_header/' "$THALAMUS" >"$SCRATCH/second.ply"
post '/v1/meshes?name=second' --data-binary "@$SCRATCH/second.ply"
second=$(json .id)
isnt "$second" "$first" 'another file is another mesh'
execute encode "{\"mesh\":\"$first\",\"lmax\":8}"
surface=$(json .surface.id)
execute encode "{\"mesh\":\"$second\",\"lmax\":8}"
isnt "$(json .surface.id)" "$surface" 'so its surface is another one, which goes when its mesh goes'
is "$(json .surface.name)" second 'under the name asked for'
is "$(json .surface.source.mesh)" "$second" 'with the mesh asked for'
is "$(json .surface.source.job)" "$(header Link | sed 's,.*/jobs/\([^>]*\)>.*,\1,')" 'and the job that ran'
get "/v1/surfaces/$surface"
is "$(json .source.mesh)" "$first" 'the first surface keeps its source'
is "$(json_in_order 'keys_unsorted | join(" ")')" \
    'id name tags lmax area volume centroid scale parameterization route source fit starShaped origin frame mirrored smoothing warnings created links' \
    'a record is in the order of the contract'

# ---- Whole numbers and names ---------------------------------------------------------------------------

for number in +48 %2048 48%20 0x30 48. ''; do
    get "/v1/surfaces/$surface/grid?nTheta=$number"
    is_problem 422 invalid-input "nTheta=$number"
done
long=$(printf '%0255d' 0 | sed 's/0/ä/g')
post "/v1/meshes?name=a%0ab" --data-binary "@$THALAMUS"
is_problem 422 invalid-input 'a name with a line feed'
post "/v1/meshes?name=$(printf '%s' "$long" | jq -sRr @uri)" --data-binary "@$THALAMUS"
is "$STATUS" 200 'a name of 255 characters, whatever their bytes'
post "/v1/meshes?name=$(printf '%sx' "$long" | jq -sRr @uri)" --data-binary "@$THALAMUS"
like "$STATUS" '^4' 'one of 256 is refused'

# ---- Details -------------------------------------------------------------------------------------------

printf 'v 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 0\nf 1 2 3\nf 1 3 4\nf 1 4 2\n' >"$SCRATCH/hole.obj"
post /v1/meshes --data-binary "@$SCRATCH/hole.obj"
hole=$(json .id)
execute encode "{\"mesh\":\"$hole\"}"
is_problem 422 mesh-not-closed 'an open mesh'
is "$(json .detail | grep -o "$hole" | wc -l)" 1 'its id is said once'
unlike "$(json .detail)" 'in all' 'its count, too'
like "$(json .detail)" 'the first belongs to face [0-9]+, .* close them$' 'and the face of the first, before the remedy'
get /v1/meshes/foo
is "$(json .detail)" 'There is no mesh "foo".' 'what is not there is named with its kind'
post_json /v1/surfaces '{}'
unlike "$(json .detail)" '^:' 'a problem of the whole body begins with a word'
# shellcheck disable=SC2028 # the escape is JSON's
post_json /v1/surfaces '{"name":"a\u0000b"}'
unlike "$(json .detail)" 'JSON_' 'a zero character is refused in words'
stop_server || not_ok 'the server ends well'
done_testing
