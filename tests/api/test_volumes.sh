#!/usr/bin/env bash
# Segmentations: uploaded, listed, each owner's own; labels extracted as meshes of genus zero that encode; and what is no
# segmentation refused with the way out.
. "$(dirname "$0")/../support/lib.sh"

VOLUMES=$ROOT/tests/data/aal_volume
start_server "$SCRATCH/data" || exit 1
execute() { # PROCESS INPUTS
    post "/v1/processes/$1/execution" -H 'Content-Type: application/json' -H 'Prefer: wait=300' -d "{\"inputs\":$2}"
}

# ---- Upload --------------------------------------------------------------------------------------------

post '/v1/volumes?name=AAL' --data-binary "@$VOLUMES/subcortex.nii.gz"
is "$STATUS" 201 'a NIfTI file is accepted'
ID=$(json .id)
like "$ID" '^vol-[0-9a-f]{32}$' 'its id is a content address'
is "$(json '[.name, .format, .shape, .spacing, .space, .units, .labelCount] | tojson')" \
    '["AAL","nifti",[86,74,60],[1,1,1],"sform","millimetres",12]' 'its record says what it is'
is "$(json '[.labels[].value] | tojson')" '[37,38,41,42,71,72,73,74,75,76,77,78]' 'all labels are listed'
is "$(json '.background + ([.labels[].voxels] | add)')" $((86 * 74 * 60)) 'and all voxels are counted'
LABELS=$(json '[.labels[] | [.value, .voxels]] | tojson')
AFFINE=$(json '.affine | tojson')
post '/v1/volumes?name=other' --data-binary "@$VOLUMES/subcortex.nii.gz"
is "$STATUS $(json .id) $(json .name)" "200 $ID other" 'sent again with a name it takes it, as a mesh does'
post '/v1/volumes?name=AAL' --data-binary "@$VOLUMES/subcortex.nii.gz"
is "$STATUS $(json .id) $(json .name)" "200 $ID AAL" 'and another one'
gzip -dc "$VOLUMES/subcortex.nii.gz" >"$SCRATCH/plain.nii"
post /v1/volumes --data-binary "@$SCRATCH/plain.nii"
is "$STATUS $(json '[.labels[] | [.value, .voxels]] | tojson')" "201 $LABELS" 'unpacked it has the same labels'
post /v1/volumes --data-binary "@$VOLUMES/subcortex.seg.nrrd"
is "$STATUS $(json .format) $(json .space)" '201 nrrd LPS' 'an NRRD file is accepted'
is "$(json '[.labels[] | [.value, .voxels]] | tojson')" "$LABELS" 'with the same labels'
is "$(json '.affine | tojson')" "$AFFINE" 'at the same place, in RAS'
is "$(json '.labels[0].name')" L_hippocampus 'and the names that the file has'
get /v1/volumes
is "$(json '[.items | length, (map(has("labels")) | any)] | tojson')" '[3,false]' 'they are listed, without labels'
get "/v1/volumes/$ID/content"
check 'the content is what was sent' cmp "$BODY" "$VOLUMES/subcortex.nii.gz"
get "/v1/volumes/vol-00000000000000000000000000000000"
is_problem 404 no-such-volume 'an unknown volume'

# ---- Extraction ----------------------------------------------------------------------------------------

execute extract "{\"volume\":\"$ID\",\"labels\":[41]}"
is "$STATUS" 200 'a label is extracted'
is "$(json '[.mesh.report.genus, .mesh.report.analysable, .mesh.report.oriented] | tojson')" '[0,true,true]' \
    'as a mesh of genus zero'
is "$(json '[.mesh.name, .mesh.source.process, .mesh.source.volume, .mesh.source.labels] | tojson')" \
    "[\"AAL: 41\",\"extract\",\"$ID\",[41]]" 'that says where it came from'
is "$(json '(.volumeChange | fabs) < 0.001 and (.volume - .voxels - .changed.added + .changed.removed | fabs) < 0.01 * .voxels')" \
    true 'with the volume of its voxels'
is "$(json '[.crossings, ([.warnings[] | select(.code == "self-crossing")] | length)] | tojson')" '[0,0]' \
    'and does not go through itself'
MESH=$(json .mesh.id)
get "/v1/meshes/$MESH"
is "$(json .source.process)" extract 'the mesh is one as any other'
get "/v1/meshes/$MESH/content"
cp "$BODY" "$SCRATCH/mesh.ply"
post /v1/meshes --data-binary "@$SCRATCH/mesh.ply"
is "$STATUS $(json .id)" "200 $MESH" 'and its content sent again is itself'
execute encode "{\"mesh\":\"$MESH\",\"lmax\":8}"
is "$STATUS $(json '.fit.relativeToDiagonal.rms < 0.02')" '200 true' 'it can be encoded'
execute extract "{\"volume\":\"$ID\",\"labels\":[75,73],\"smoothing\":0}"
is "$STATUS $(json '[.mesh.report.genus, .inputs.labels, .smoothing] | tojson')" '200 [0,[73,75],0]' \
    'several labels are one structure'
execute extract "{\"volume\":\"$ID\",\"labels\":[37,38]}"
is "$(json '[.mesh.report.genus, (.changed.places[0].change)] | tojson')" '[0,"island-removed"]' \
    'of two that do not touch the larger is kept'
is "$(json '.changed.removed == .changed.places[0].voxels and .changed.count == 1 and (.changed.places[0].position[0] < -20)')" true \
    'and the other counted and located'
is "$(json '(.warnings | map(.code)) == ["topology-changed"] and .warnings[0].figures == {added: .changed.added, removed: .changed.removed, voxels: .voxels}')" \
    true 'and a change of more than a hundredth is told of'
like "$(json '.warnings[0].detail')" '0 voxels were added and 7469 removed' 'with the counts'
execute extract "{\"volume\":\"$ID\",\"labels\":[37,38],\"topology\":\"refuse\"}"
is "$STATUS $(json .code)" '422 not-genus-zero' 'or refused'
like "$(json .detail)" '7469 voxels at 1 places' 'with where it is'

# A study takes the volume along, and what extracted its meshes, but no other extraction.
request PATCH "/v1/volumes/$ID" --data '{"tags":["atlas"]}' -H 'Content-Type: application/json'
execute extract "{\"volume\":\"$ID\",\"labels\":[41]}"
cp "$BODY" "$SCRATCH/extract.json"
post /v1/cohorts -H 'Content-Type: application/json' -d "{\"name\":\"extracted\",\"members\":[{\"id\":\"$MESH\"}]}"
curl -fsS -o "$SCRATCH/study.zip" "$URL/v1/cohorts/extracted/export"
is "$(unzip -Z1 "$SCRATCH/study.zip" | grep -c '^volumes/')" 1 'the export of a study has the volume'
unzip -p "$SCRATCH/study.zip" "volumes/$ID.nii.gz" | cmp - "$VOLUMES/subcortex.nii.gz"
is $? 0 'as it was sent'
is "$(unzip -p "$SCRATCH/study.zip" srnfd-study.json | jq -c '[.jobs[].process] | sort')" '["encode","extract"]' \
    'and the one job of many that made the mesh'
HERE=$URL
FIRST=$SERVER_PID
start_server "$SCRATCH/other" --workers 1 || exit 1
post /v1/imports --data-binary "@$SCRATCH/study.zip"
is "$STATUS $(json '[(.volumes | length), .restored.jobs, (.refused | length)] | tojson')" '201 [1,2,0]' 'another server restores both'
get "/v1/volumes/$ID"
is "$STATUS $(json '[.name, .tags] | tojson')" '200 ["AAL",["atlas"]]' 'with name and tags'
execute extract "{\"volume\":\"$ID\",\"labels\":[41]}"
check 'and answers from its cache' cmp "$BODY" "$SCRATCH/extract.json"
request DELETE "/v1/volumes/$ID"
is_problem 409 in-use 'a volume that a mesh needs stays'
stop_server || not_ok 'the other server ends well'
SERVER_PID=$FIRST
URL=$HERE

# A plate of 2 x 14 x 14 with a hole in it, at the edge of a volume of its own.
{
    printf 'NRRD0004\ntype: uchar\ndimension: 3\nsizes: 16 16 4\nspace: RAS\nencoding: ascii\n'
    printf 'space directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (100,0,0)\n\n'
    awk 'BEGIN { for (k = 0; k < 4; k++) for (j = 0; j < 16; j++) for (i = 0; i < 16; i++)
        print (k < 2 && i > 0 && i < 15 && j > 0 && j < 15 && !(i == 7 && j == 8)) }'
} >"$SCRATCH/plate.nrrd"
post /v1/volumes --data-binary "@$SCRATCH/plate.nrrd"
PLATE=$(json .id)
execute extract "{\"volume\":\"$PLATE\",\"labels\":[1]}"
is "$(json '[.changed.voxels, .changed.places[0].change, .changed.places[0].position[0:2]] | tojson')" \
    '[1,"tunnel-filled",[114,16]]' 'a hole is closed, and told where'
is "$(json '[.warnings[].code] | tojson')" '["label-at-border"]' 'and the edge of the volume is told of, one voxel in 390 not'

# ---- Refusals ------------------------------------------------------------------------------------------

execute extract "{\"volume\":\"$ID\",\"labels\":[41,9999]}"
is_problem 422 invalid-input 'a label that is not there'
like "$(json '.errors[0].detail')" 'no label 9999' 'is named'
execute extract "{\"volume\":\"$ID\",\"labels\":[0]}"
is_problem 422 invalid-input 'the background'
execute extract "{\"volume\":\"$ID\",\"labels\":[]}"
is_problem 422 invalid-input 'no label'
execute extract '{"volume":"vol-00000000000000000000000000000000","labels":[1]}'
is_problem 404 no-such-volume 'a volume that is not there'
refused() { # NAME WORDS FILE
    post /v1/volumes --data-binary "@$3"
    is_problem 422 unparsable-volume "$1"
    like "$(json .detail)" "$2" "$1: the reason"
}
head -c 5000 "$VOLUMES/subcortex.nii.gz" >"$SCRATCH/cut.nii.gz"
refused 'a truncated file' 'cut off' "$SCRATCH/cut.nii.gz"
{
    head -c 40 "$SCRATCH/plain.nii"
    printf '\007\0\377\177\377\177\377\177\377\177\001\0\001\0\001\0'
    tail -c +57 "$SCRATCH/plain.nii"
} >"$SCRATCH/huge.nii"
refused 'more voxels than are taken' 'promises 32767 x 32767 x 32767|several volumes' "$SCRATCH/huge.nii"
refused 'a mesh' 'no NIfTI' "$SCRATCH/mesh.ply"
: >"$SCRATCH/empty"
refused 'nothing' 'empty' "$SCRATCH/empty"
post /v1/volumes -H 'Content-Type: application/json' -d '{}'
is_problem 415 unsupported-media-type 'JSON is no volume'

# ---- Owners --------------------------------------------------------------------------------------------

stop_server || not_ok 'the server ends well'
check 'the data are sound' "$SRNFD" check --data "$SCRATCH/data"
ADA=$("$SRNFD" token add --data "$SCRATCH/data" --name ada 2>/dev/null)
BEN=$("$SRNFD" token add --data "$SCRATCH/data" --name ben 2>/dev/null)
start_server "$SCRATCH/data" || exit 1
as() { # TOKEN ARGUMENTS..
    curl -sS -o "$SCRATCH/as" -w '%{http_code}' -H "Authorization: Bearer $1" "${@:2}"
}
is "$(as "$ADA" "$URL/v1/volumes?name=hers" --data-binary "@$VOLUMES/subcortex.nii.gz")" 201 'it is new to each owner'
is "$(as "$BEN" "$URL/v1/volumes/$ID")" 404 'and not there for others'
is "$(as "$BEN" "$URL/v1/processes/extract/execution" -H 'Content-Type: application/json' \
    -d "{\"inputs\":{\"volume\":\"$ID\",\"labels\":[41]}}")" 404 'nor to compute with'
is "$(as "$BEN" "$URL/v1/volumes") $(jq '.items | length' "$SCRATCH/as")" '200 0' 'nor in their lists'
is "$(as "$ADA" "$URL/v1/volumes/$ID") $(jq -r .name "$SCRATCH/as")" '200 hers' 'its owner has it under the own name'


# ---- Deletion ------------------------------------------------------------------------------------------

is "$(as "$BEN" -X DELETE "$URL/v1/volumes/$ID")" 404 'nobody deletes what is not theirs'
is "$(as "$ADA" "$URL/v1/processes/extract/execution" -H 'Content-Type: application/json' -H 'Prefer: wait=60' \
    -d "{\"inputs\":{\"volume\":\"$ID\",\"labels\":[41]}}")" 200 'a volume is in use'
MESH=$(jq -r .mesh.id "$SCRATCH/as")
is "$(as "$ADA" -X DELETE "$URL/v1/volumes/$ID") $(jq -r '.code + " " + (.neededBy | map(.kind) | sort | join(" "))' "$SCRATCH/as")" \
    '409 in-use job mesh' 'and is not deleted then'
is "$(as "$ADA" -X DELETE "$URL/v1/volumes/$ID?cascade=true")" 204 'but with what needs it'
is "$(as "$ADA" "$URL/v1/volumes/$ID") $(as "$ADA" "$URL/v1/meshes/$MESH")" '404 404' 'which both have gone'
is "$(as "$ADA" -X DELETE "$URL/v1/volumes/$ID")" 404 'once'
stop_server || not_ok 'the server ends well'
check 'the check finds nothing wrong' "$SRNFD" check --data "$SCRATCH/data"
done_testing
