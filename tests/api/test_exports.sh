#!/usr/bin/env bash
# srnfd-test: timeout 240
# test_exports.sh - a study as one zip, and another server that restores it: the same ids, and the same answers from its
# cache.
# srnfd-test: slow
# srnfd-test: once (formats do not depend on the build)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/a" --workers 2 || exit 1
FIRST=$SERVER_PID

AAL=tests/data/aal_subcortex
printf 'file,label,subject,side,age\nL_amygdala.ply,a,s1,left,40\nR_amygdala.ply,b,s2,right,41\nL_pallidum.ply,a,s3,left,42\nR_pallidum.ply,b,s4,right,43\n' \
    >"$SCRATCH/labels.csv"
request POST '/v1/imports?cohort=study' -F "f=@$SCRATCH/labels.csv" -F "f=@$AAL/L_amygdala.ply" -F "f=@$AAL/R_amygdala.ply" \
    -F "f=@$AAL/L_pallidum.ply" -F "f=@$AAL/R_pallidum.ply"
is "$STATUS" 201 'a study comes in'
post '/v1/meshes?name=apart' --data-binary "@$AAL/L_thalamus.ply"
APART=$(json .id)
execute encode "{\"mesh\":\"$APART\",\"lmax\":4}"
is "$STATUS" 200 'and work that is no part of it'

# Everything that is asked of both servers.
ask() { # FILE
    local wait='Prefer: respond-async, wait=100'
    execute distances '{"cohort":"study","register":false}' --header "$wait"
    cp "$BODY" "$1.distances"
    execute pca '{"cohort":"study","register":false,"lmax":6}' --header "$wait"
    cp "$BODY" "$1.pca"
    MODEL=$(json .model.id)
    execute modes "{\"model\":\"$MODEL\",\"mode\":1,\"coefficients\":[1]}" --header "$wait"
    cp "$BODY" "$1.modes"
    MAPPED=$(json '.surfaces[0].id')
    execute sample "{\"model\":\"$MODEL\",\"count\":1,\"seed\":7}" --header "$wait"
    cp "$BODY" "$1.sample"
}
ask "$SCRATCH/a.answer"
is "$STATUS" 200 'jobs are done on it'
request PATCH "/v1/surfaces/$MAPPED" --data '{"tags":["kept"]}' --header 'Content-Type: application/json'
is "$STATUS" 200 'and tags are given'
get '/v1/jobs?process=pca'
JOB=$(json '.jobs[0].id')
for path in "jobs/$JOB" "models/$MODEL"; do
    request PATCH "/v1/$path" --data '{"name":"the model","tags":["final"]}' --header 'Content-Type: application/json'
    is "$STATUS" 200 "and names, to ${path%%/*}"
done
get "/v1/surfaces/$MAPPED/mesh?format=ply"
cp "$BODY" "$SCRATCH/a.ply"
get /v1/cohorts/study
cp "$BODY" "$SCRATCH/a.cohort"

# ---- The zip -----------------------------------------------------------------------------------------

get /v1/cohorts/study/export
is "$STATUS $(header Content-Type) $(header Content-Disposition)" \
    '200 application/zip attachment; filename="study.zip"' 'the study is one zip'
cp "$BODY" "$SCRATCH/study.zip"
is "$(wc -c <"$SCRATCH/study.zip")" "$(header Content-Length)" 'of the length that was announced'
TAG=$(header ETag)
like "$TAG" '^"[0-9a-f]{64}"$' 'with the digest of its bytes as its tag'
is "$TAG" "\"$(sha256sum <"$SCRATCH/study.zip" | cut -c 1-64)\"" 'which it is'
SIZE=$(wc -c <"$SCRATCH/study.zip")
is "$(tail -c 22 "$SCRATCH/study.zip" | head -c 4 | od -An -tx1)" ' 50 4b 05 06' 'it ends with its directory'
head -c 1000 "$SCRATCH/study.zip" >"$SCRATCH/part.zip"
get /v1/cohorts/study/export --header 'Range: bytes=1000-' --header "If-Range: $TAG"
is "$STATUS $(header Content-Range)" "206 bytes 1000-$((SIZE - 1))/$SIZE" 'who was cut off asks for the rest'
cat "$BODY" >>"$SCRATCH/part.zip"
check 'which fits' cmp "$SCRATCH/part.zip" "$SCRATCH/study.zip"
get /v1/cohorts/study/export --header 'Range: bytes=5-9'
is "$STATUS $(wc -c <"$BODY")" '206 5' 'a part in the middle'
get /v1/cohorts/study/export --header "If-None-Match: $TAG"
is "$STATUS" 304 'who has it need not get it again'
mkdir "$SCRATCH/open"
check 'unzip can read it' unzip -q "$SCRATCH/study.zip" -d "$SCRATCH/open"
is "$(find "$SCRATCH/open/meshes" -type f | wc -l)" 4 'it has the four meshes'
file=$(jq -r '.meshes[] | select(.name == "L_amygdala").file' "$SCRATCH/open/srnfd-study.json")
check 'with the bytes that were uploaded' cmp "$SCRATCH/open/$file" "$AAL/L_amygdala.ply"
is "$(find "$SCRATCH/open/surfaces" -name '*.ply' -size +60k | wc -l)" 0 'meshes of surfaces are no finer than their degree asks'
is "$(jq -r '[.jobs[].process] | sort | join(" ")' "$SCRATCH/open/srnfd-study.json")" 'distances modes pca sample' \
    'the jobs on it, and no others'
is "$(jq -r '.jobs[] | select(has("seed")) | "\(.process) \(.seed)"' "$SCRATCH/open/srnfd-study.json")" 'sample 7' \
    'with the seeds of their random numbers'
is "$(jq -r '."@graph"[] | select(."@id" == "ro-crate-metadata.json") | .conformsTo."@id"' "$SCRATCH/open/ro-crate-metadata.json")" \
    'https://w3id.org/ro/crate/1.1' 'the metadata are an RO-Crate'
is "$(jq -r '[."@graph"[] | select(."@type" == "File")."@id"][]' "$SCRATCH/open/ro-crate-metadata.json" |
    while read -r file; do [ -f "$SCRATCH/open/$file" ] || echo "$file"; done)" '' 'whose files are there'
is "$(jq -r '[.files + (.jobs | map({(.file): .sha256}) | add) | to_entries[] | "\(.value)  \(.key)"] | sort[]' \
    "$SCRATCH/open/srnfd-study.json")" \
    "$(cd "$SCRATCH/open" && find . -type f ! -path ./srnfd-study.json -printf '%P\0' | xargs -0 sha256sum | sort)" \
    'every file has its digest in the manifest'
is "$(head -n 1 "$SCRATCH/open/cohort.csv" | tr -d '\r')" 'id,label,subject,time,side,mirror,age' 'the members are a table'
is "$(find "$SCRATCH/open/models" -name '*-scores.csv' | wc -l)" 1 'and so are the scores'
get "/v1/models/$MODEL/export"
is "$STATUS" 200 'a model is exported as well'
cp "$BODY" "$SCRATCH/model.zip"
listed() { # FILE JQ
    unzip -p "$1" srnfd-study.json | jq -r "$2"
}
is "$(listed "$SCRATCH/model.zip" '[[.jobs[].process], (.meshes | length), [.models[].id]] | tojson')" \
    "[[\"pca\"],4,[\"$MODEL\"]]" 'with its members and the job that made it, and nothing else that was made of them'
execute encode '{"cohort":"study","lmax":4}' --header 'Prefer: wait=100'
post_json /v1/cohorts "$(json '{name: "encoded", members: [.rows[] | {id: .surface, label: "secret"}]} | tojson')"
execute distances '{"cohort":"encoded","register":false}' --header 'Prefer: wait=100'
execute mean '{"cohort":"encoded","register":false}' --header 'Prefer: wait=100'
execute pca '{"cohort":"encoded","register":false,"components":1}' --header 'Prefer: wait=100'
execute pca '{"cohort":"encoded","register":false}' --header 'Prefer: wait=100'
ENCODED=$(json .model.id)
get "/v1/models/$ENCODED/export"
cp "$BODY" "$SCRATCH/encoded.zip"
is "$(listed "$SCRATCH/encoded.zip" '[([.jobs[].process] | sort), (.meshes | length), [.models[].id]] | tojson')" \
    "[[\"encode\",\"pca\"],4,[\"$ENCODED\"]]" 'what encoded its members is there, and no other model of them'
get /v1/cohorts/none/export
is_problem 404 no-such-cohort 'what is not there is not'

# ---- On another server -------------------------------------------------------------------------------

start_server "$SCRATCH/b" --workers 1 || exit 1
SECOND=$SERVER_PID
post /v1/imports --data-binary "@$SCRATCH/study.zip" --header 'Content-Type: application/zip'
is "$STATUS $(json '"\(.cohort.name) \(.meshes | length) \(.restored.models) \(.restored.jobs) \(.refused | length)"')" \
    '201 study 4 1 4 0' 'another server restores it'
get /v1/cohorts/study
is "$(json '.members | tojson')" "$(jq -r '.members | tojson' "$SCRATCH/a.cohort")" 'with the same members'
get "/v1/surfaces/$MAPPED/mesh?format=ply"
check 'surfaces with maps are the same to the byte' cmp "$BODY" "$SCRATCH/a.ply"
get "/v1/surfaces/$MAPPED"
is "$(json '.tags | join(" ")')" kept 'with their tags'
get '/v1/jobs?limit=200'
is "$(json '[.jobs[].id] | length')" 4 'the jobs are there'
get '/v1/jobs?tag=final&name=model'
is "$(json '[.jobs[] | [.id, .name, .tags]] | tojson')" "[[\"$JOB\",\"the model\",[\"final\"]]]" 'with names and tags'
get "/v1/models/$MODEL"
is "$(json '[.name, .tags] | tojson')" '["the model",["final"]]' 'as models have them'
ask "$SCRATCH/b.answer"
for answer in distances pca modes sample; do
    check "the same request has the same answer, $answer" cmp "$SCRATCH/a.answer.$answer" "$SCRATCH/b.answer.$answer"
done
get '/v1/jobs?limit=200'
is "$(json '[.jobs[].id] | length')" 4 'from the cache: no job was made'
post /v1/imports --data-binary "@$SCRATCH/study.zip" --header 'Content-Type: application/zip'
is "$STATUS" 200 'the same again changes nothing'

# ---- What was changed --------------------------------------------------------------------------------

start_server "$SCRATCH/c" --workers 1 || exit 1
THIRD=$SERVER_PID
file=$(find "$SCRATCH/open/surfaces" -name '*.npz' | head -n 1)
other=$(find "$SCRATCH/open/surfaces" -name '*.npz' | tail -n 1)
cp "$file" "$SCRATCH/kept.npz"
cp "$other" "$file"
(cd "$SCRATCH/open" && zip -q -0 -r ../changed.zip srnfd-study.json meshes surfaces models jobs)
cp "$SCRATCH/kept.npz" "$file"
post '/v1/imports?partial=true' --data-binary "@$SCRATCH/changed.zip" --header 'Content-Type: application/zip'
is "$STATUS $(json '"\(.code) \(.refused[0].code)"')" '422 import-refused not-as-described' \
    'a surface that has not the content of its id is refused'
get '/v1/meshes'
is "$(json '.items | length')" 0 'and nothing of the study is kept'

# Sends the study with another manifest (a jq program), and with files left out of it.
edited() { # PROGRAM [FILE]
    rm -rf "$SCRATCH/edit" "$SCRATCH/edit.zip"
    cp -r "$SCRATCH/open" "$SCRATCH/edit"
    jq "$1" "$SCRATCH/open/srnfd-study.json" >"$SCRATCH/edit/srnfd-study.json"
    [ -z "${2-}" ] || rm "$SCRATCH/edit/$2"
    (cd "$SCRATCH/edit" && zip -q -0 -r ../edit.zip srnfd-study.json meshes surfaces models jobs)
    post /v1/imports --data-binary "@$SCRATCH/edit.zip" --header 'Content-Type: application/zip'
}
edited '.meshes[0].file as $a | .meshes[1].file as $b | .meshes[0].file = $b | .meshes[1].file = $a'
is "$STATUS $(json '[.refused[].code] | join(" ")')" '422 not-as-described not-as-described' 'nor are meshes that were swapped'
edited '.format = "x"'
is_problem 422 unparsable-archive 'a manifest says what it is'
for list in volumes meshes surfaces models jobs; do
    edited ".$list = 5"
    is_problem 422 unparsable-archive "$list are a list"
    like "$(json .detail)" "/$list must be an array" 'as is said'
done
edited '.cohort.members = "{}"'
is "$STATUS $(json '.errors[0].pointer')" '422 /cohort/members' 'members are an array'
edited '.cohort.members = "[]"'
is "$STATUS $(json '.errors[0].pointer')" '422 /cohort/members' 'that is not empty'
edited '.cohort.name = "../x"'
is "$STATUS $(json '.errors[0].pointer')" '422 /cohort/name' 'and a cohort has a name'
edited '.surfaces[0].record |= sub("\"mirrored\":false"; "\"mirrored\":true") | .surfaces[0].record |= . + " "'
is "$STATUS $(json '.refused[0] | "\(.code) \(.file)"')" '422 not-as-described srnfd-study.json' 'nor is a record that was edited'
like "$(json '.refused[0].detail')" "^what it says of $(jq -r '.surfaces[0].id' "$SCRATCH/open/srnfd-study.json") .*was changed" \
    'which is what the refusal names, and not the numbers'
edited '.models[0].nTheta += 1'
is "$STATUS $(json '.refused[0] | "\(.code) \(.file)"')" "422 not-as-described $(jq -r '.models[0].file' "$SCRATCH/open/srnfd-study.json")" \
    'nor a model of which something else is said'
like "$(json '.refused[0].detail')" 'not what srnfd-study.json says of it: its content was changed, or what is said of it' \
    'of which either may have been changed'
like "$(json .detail)" 'Export the study again, or send' 'which is mended by the export alone'
edited '.cohort.members |= sub("left"; "right")'
is "$STATUS $(json '.errors[0].pointer')" '422 /cohort/members' 'nor are members of whom something else is said'
edited '.files = 5'
is_problem 422 unparsable-archive 'digests of files are an object'
edited '.jobs[0].sha256 |= ascii_upcase'
is "$STATUS $(json '.refused[0].code')" '422 not-as-described' 'nor are results of another digest'
edited '.jobs[0].inputs |= sub("{"; "{ ")'
is "$STATUS $(json '.refused[0] | "\(.code) \(.file)"')" '422 not-as-described srnfd-study.json' 'nor are inputs of a job that were edited'
edited '.jobs[0].process = "encode"'
is "$STATUS $(json '.refused[0].code')" '422 not-as-described' 'nor is another process'
edited '.jobs[0].numericBuild += "0"'
is "$STATUS $(json '.refused[0].code')" '422 not-as-described' 'nor another numeric build'
edited '.jobs[0].tags = "[7]"'
is "$STATUS $(json '.refused[0].code')" '422 not-as-described' 'nor is a tag that is a number'
for source in '[]' '{"process":"mirror","volume":[]}' '{"process":"none"}' "{\"process\":\"mirror\",\"note\":\"$(printf '%5000s' '')\"}"; do
    edited ".meshes[0].source = $(jq -Rs . <<<"$source")"
    is "$STATUS $(json '.refused[0].code')" '422 not-as-described' "nor is what made a mesh, ${source:0:32}"
done
job=$(jq -r '.jobs[0].file' "$SCRATCH/open/srnfd-study.json")
edited . "$job"
is "$STATUS $(json '[.refused[] | "\(.file) \(.code)"] | join(" ")')" "422 $job no-such-file" 'results that are missing are named'
edited '.jobs[0].file = "../../etc/passwd"'
is "$STATUS $(json '[.refused[] | "\(.file) \(.code)"] | join(" ")')" '422 ../../etc/passwd no-such-file' \
    'as are those that lie elsewhere'
get '/v1/jobs'
is "$(json '.jobs | length')" 0 'and no job is kept'

# Sends the study with a byte behind the content of a file of it, which no reader would miss.
touched() { # FILE..
    local file
    rm -rf "$SCRATCH/edit" "$SCRATCH/edit.zip"
    cp -r "$SCRATCH/open" "$SCRATCH/edit"
    for file in "$@"; do
        printf ' ' >>"$SCRATCH/edit/$file"
    done
    (cd "$SCRATCH/edit" && zip -q -0 -r ../edit.zip .)
    post /v1/imports --data-binary "@$SCRATCH/edit.zip" --header 'Content-Type: application/zip'
}
for kind in meshes surfaces models jobs; do
    file=$(jq -r ".${kind}[0].file" "$SCRATCH/open/srnfd-study.json")
    touched "$file"
    is "$STATUS $(json '[.refused[] | "\(.file) \(.code)"] | join(" ")')" "422 $file not-as-described" \
        "one byte more is a change, $kind"
done
get '/v1/meshes'
is "$(json '.items | length')" 0 'and nothing is kept of it'
post /v1/imports --data-binary "@$SCRATCH/model.zip" --header 'Content-Type: application/zip'
is "$STATUS $(json '"\(.cohort) \(.restored.models)"')" '201 null 1' 'a model is restored by itself'
get "/v1/models/$MODEL/scores?format=csv"
is "$STATUS" 200 'with its scores'
post /v1/imports --data-binary "@$SCRATCH/encoded.zip" --header 'Content-Type: application/zip'
is "$STATUS $(json '"\(.restored.models) \(.restored.jobs)"')" '201 1 2' 'so is one of encoded members, with both jobs'
post '/v1/meshes?name=apart' --data-binary "@$AAL/L_thalamus.ply"
for process in project score; do
    execute "$process" "{\"model\":\"$ENCODED\",\"surface\":\"$(json '.id // .inputs.surface')\"}" --header 'Prefer: wait=100'
    is "$STATUS" 200 "and $process takes it"
done

# Ids are hashes that anybody can make: a model must also be one.
for what in record infinite huge downward negative parts mean degree; do
    tests/support/forge_model.py "$SCRATCH/model.zip" "$SCRATCH/forged.zip" "$what" >"$SCRATCH/forged"
    post /v1/imports --data-binary "@$SCRATCH/forged.zip" --header 'Content-Type: application/zip'
    is "$STATUS $(json '.refused[0].code')" "422 $([ $what = mean ] && echo no-such-surface || echo not-as-described)" \
        "a forged model is refused, $what"
    get "/v1/models/$(cat "$SCRATCH/forged")"
    is "$STATUS" 404 'and not kept'
done

# Results have a digest that anybody can write anew: what they hold proves nothing, and may not be what the service makes.
file=$(jq -r '.jobs[] | select(.process == "distances").file' "$SCRATCH/open/srnfd-study.json")
JOB=$(jq -r '.jobs[] | select(.process == "distances").id' "$SCRATCH/open/srnfd-study.json")
forged_results() { # PROGRAM: sends the study with distances that it changes
    rm -rf "$SCRATCH/edit" "$SCRATCH/edit.zip"
    cp -r "$SCRATCH/open" "$SCRATCH/edit"
    jq -c "$1" "$SCRATCH/open/$file" >"$SCRATCH/edit/$file"
    jq --arg digest "$(sha256sum "$SCRATCH/edit/$file" | cut -d ' ' -f 1)" \
        '.jobs |= map(if .process == "distances" then .sha256 = $digest else . end)' \
        "$SCRATCH/open/srnfd-study.json" >"$SCRATCH/edit/srnfd-study.json"
    (cd "$SCRATCH/edit" && zip -q -0 -r ../edit.zip srnfd-study.json meshes surfaces models jobs)
    post /v1/imports --data-binary "@$SCRATCH/edit.zip" --header 'Content-Type: application/zip'
}
while IFS='@' read -r program why; do
    forged_results "$program"
    is "$STATUS $(json '.refused[0] | "\(.code) \(.file)"')" "422 not-as-described $file" "no table could be made of $program"
    like "$(json '.refused[0].detail')" "cannot be used: $why\$" 'as is said'
done <<'EDITS'
.labels = []@it has no labels
del(.labels)@it has no labels
.labels |= .[1:]@matrix has 4 rows for 3 labels
.matrix |= .[1:]@matrix has 3 rows for 4 labels
.matrix = [[1],[1],[1],[1]]@row 1 of matrix has 1 numbers instead of 4
.matrix[3][0] = "x"@matrix has in row 4, column 1 no number
EDITS
forged_results '.labels |= map(null)'
like "$STATUS" '^20' 'results may have no labels'
get "/v1/jobs/$JOB/results?format=csv"
is "$STATUS $(head -n 1 "$BODY" | tr -cd , | wc -c)" '200 6' 'and then have a table without'
# Results that were kept before imports looked, whose bytes are whole.
while IFS='@' read -r process format text why; do
    python3 - "$SCRATCH/c/srnfd.db" "$JOB" "$process" "$text" <<'EOF'
import hashlib, sqlite3, sys
path, job, process, text = sys.argv[1:]
digest = hashlib.sha256(text.encode()).hexdigest()
store = sqlite3.connect(path, timeout=60)
with store:
    store.execute('INSERT OR IGNORE INTO blob VALUES (?, ?, ?)', (digest, len(text), text.encode()))
    store.execute('UPDATE job SET process = ?, results = ? WHERE id = ?', (process, digest, job))
store.close()
EOF
    get "/v1/jobs/$JOB/results?format=$format"
    is_problem 500 data-damaged "$process that no table can be made of are damaged, $format"
    like "$(json .detail)" ": $why\.$" 'and it is said how'
done <<'RESULTS'
distances@csv@{"labels":["a","b"],"matrix":[["x",1],[1,0]]}@matrix has in row 1, column 1 no number
distances@npy@{"labels":["a","b"],"matrix":[[1,"x"],[1,0]]}@matrix has in row 1, column 2 no number
neighbours@csv@{"labels":["a","b"],"indices":[[1],[2]],"distances":[[1],[1]]}@row 2 of indices names none of 2 members
neighbours@npy@{"labels":["a","b"],"indices":[[1],[0]],"distances":[[1],[]]}@row 2 of distances has 0 numbers instead of 1
encode@csv@{"rows":[{},5]}@row 2 of rows is no object
classify@csv@{"classes":[],"methods":{"gaussian":{"perSubject":5}}}@method gaussian has no array perSubject
RESULTS
get /healthz
is "$STATUS" 200 'and the service goes on'

# ---- By two owners of one server ---------------------------------------------------------------------

token() { "$SRNFD" token add --data "$SCRATCH/d" --name "$1" 2>/dev/null; }
ADA=$(token ada)
BOB=$(token bob)
start_server "$SCRATCH/d" --workers 1 --max-owner-exports 131072 || exit 1
FOURTH=$SERVER_PID
tests/support/forge_model.py "$SCRATCH/model.zip" "$SCRATCH/alone.zip" alone >"$SCRATCH/forged"
# Unpacked and packed again, in an order of its own, with the manifest last; in a folder; in that of tar.
(cd "$SCRATCH/open" && zip -q -1 -r ../packed.zip cohort.csv ro-crate-metadata.json jobs models surfaces meshes srnfd-study.json)
(cd "$SCRATCH" && zip -q -r folder.zip open/cohort.csv open/models open/jobs open/surfaces open/meshes open/srnfd-study.json)
(cd "$SCRATCH/open" && tar czf ../dot.tgz ./cohort.csv ./models ./jobs ./surfaces ./meshes ./srnfd-study.json)
study=$SCRATCH/packed.zip
for token in "$ADA" "$BOB"; do
    auth="Authorization: Bearer $token"
    post /v1/imports --data-binary "@$SCRATCH/alone.zip" --header 'Content-Type: application/zip' --header "$auth"
    is "$STATUS $(json '.refused[0].code')" '422 no-such-surface' 'no model without its mean, which others may have'
    post /v1/imports --data-binary "@$study" --header 'Content-Type: application/zip' --header "$auth"
    is "$STATUS $(json .restored.jobs)" '201 4' 'an owner restores the study'
    study=$SCRATCH/folder.zip
    get '/v1/jobs?limit=200' --header "$auth"
    is "$(json '[.jobs[] | .message] | unique | join(", ")') $(json .total)" 'restored from an archive 4' 'and has its jobs'
    get '/v1/jobs?tag=final' --header "$auth"
    is "$(json '[.jobs[].name] | join(", ")')" 'the model' 'with their names and tags'
    get '/v1/jobs?limit=200' --header "$auth"
    json '.jobs[].id' | sort >"$SCRATCH/ids.$token"
    execute distances '{"cohort":"study","register":false}' --header "$auth"
    is "$(header Cache-Status)" 'srnfd; hit' 'which answer from the cache'
    get "/v1/surfaces/$MAPPED" --header "$auth"
    job=$(json .source.job)
    get "/v1/jobs/$job" --header "$auth"
    is "$STATUS" 200 'and are named in the records of what they made'
done
is "$(comm -12 "$SCRATCH/ids.$ADA" "$SCRATCH/ids.$BOB")" '' 'each owner has jobs of its own'
auth="Authorization: Bearer $(token eve)"
post /v1/imports --data-binary "@$SCRATCH/dot.tgz" --header 'Content-Type: application/gzip' --header "$auth"
is "$STATUS $(json .restored.jobs)" '201 4' 'a tar is a study wherever its manifest stands'
(cd "$SCRATCH" && cp "$ROOT/$AAL/L_thalamus.ply" . && zip -q stray.zip open/srnfd-study.json L_thalamus.ply)
post '/v1/imports?partial=true' --data-binary "@$SCRATCH/stray.zip" --header 'Content-Type: application/zip' --header "$auth"
is "$STATUS $(json '[(.meshes | length), .refused[0].file] | tojson')" '201 [1,"open/srnfd-study.json"]' \
    'and one in a folder makes none of what lies beside the folder'
request POST /v1/imports --header "$auth" -F "f=@$SCRATCH/L_thalamus.ply" -F "g=@$SCRATCH/study.zip"
is_problem 422 unparsable-archive 'nor does an export that comes after others'

# ---- Room on the disk --------------------------------------------------------------------------------

# What is on the way to a slow reader is a file of the data directory: one export of an owner that is larger than the
# share, and no second one beside it.
is "$((SIZE > 196608))" 1 'the study is larger than the share of an owner'
auth="Authorization: Bearer $ADA"
exec {slow}<> >(exec python3 -c '
import socket, sys
host, port = sys.argv[1].split("//")[1].split(":")
slow = socket.socket()
slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
slow.connect((host, int(port)))
slow.sendall(f"GET /v1/cohorts/study/export HTTP/1.1\r\nHost: {host}:{port}\r\n{sys.argv[2]}\r\n\r\n".encode())
print(slow.recv(12).decode(), file=open(sys.argv[3], "w"))
sys.stdin.read()
' "$URL" "$auth" "$SCRATCH/slow")
READER=$!
for _ in {1..600}; do
    [ -s "$SCRATCH/slow" ] && break
    sleep 0.1
done
is "$(cat "$SCRATCH/slow")" 'HTTP/1.1 200' 'an export is on its way to a slow reader'
get /v1/cohorts/study/export --header "$auth"
is_problem 503 server-busy 'the same owner gets no second one meanwhile'
like "$(json .detail) $(header Retry-After)" 'Exports of this token.* share of the disk.* [0-9]+$' 'and is told when to ask again'
get /v1/cohorts/study/export --header "Authorization: Bearer $BOB"
is "$STATUS $(wc -c <"$BODY")" "200 $(header Content-Length)" 'another owner gets one'
get /v1/cohorts/study/export --header "Authorization: Bearer $BOB"
is "$STATUS" 200 'and a second, once the first was taken'
kill "$READER"
wait "$READER" 2>/dev/null
for _ in {1..100}; do
    get /v1/cohorts/study/export --header "$auth"
    [ "$STATUS" = 503 ] || break
    sleep 0.1
done
is "$STATUS" 200 'who has gone holds no room'
start_server "$SCRATCH/e" --workers 1 --least-free 1000000000000000 || exit 1
FIFTH=$SERVER_PID
post /v1/imports --data-binary "@$SCRATCH/study.zip" --header 'Content-Type: application/zip'
get /v1/cohorts/study/export
is_problem 507 storage-full 'nor does an export take what the disk is to keep free'

# ---- What the study does without ---------------------------------------------------------------------

# What is made of the others, for people, is not needed: that it is damaged or gone is told.
file=$(cd "$SCRATCH/open" && echo surfaces/*.ply)
file=${file%% *}
rm "$SCRATCH/open/$file"
scores=$(cd "$SCRATCH/open" && echo models/*-scores.csv)
table=$(jq -r '.jobs[] | select(.process == "distances").file | sub("json$"; "csv")' "$SCRATCH/open/srnfd-study.json")
touched cohort.csv ro-crate-metadata.json "$table" "$scores"
like "$STATUS" '^20[01]$' 'a study is restored without what is made of it'
is "$(json_in_order '.warnings | map([.code, .figures.count, .figures.changed, .figures.missing, (.figures.files | sort)]) | tojson')" \
    "$(jq -nc '[["files-passed-over", 5, 4, 1, ($ARGS.positional | sort)]]' --args \
        cohort.csv ro-crate-metadata.json "$table" "$scores" "$file")" 'which is told'
like "$(json '.warnings[0].detail')" 'cohort\.csv' 'by its names'
post /v1/imports --data-binary "@$SCRATCH/study.zip" --header 'Content-Type: application/zip'
is "$STATUS $(json '.warnings | tojson')" '200 []' 'the whole study has no such warning'
file=$(jq -r '.surfaces[0].file' "$SCRATCH/open/srnfd-study.json")
touched "$file"
is "$STATUS $(json '.refused[0] | "\(.file) \(.code)"')" "422 $file not-as-described" \
    'a changed surface is refused also where it is there already'
jq 'del(.files, .cohort.sha256)' "$SCRATCH/open/srnfd-study.json" >"$SCRATCH/older.json"
cp "$SCRATCH/older.json" "$SCRATCH/open/srnfd-study.json"
touched cohort.csv
is "$STATUS $(json '.warnings | tojson')" '200 []' 'an archive of an older version has no digests of files'

for pid in "$FIFTH" "$FOURTH" "$FIRST" "$SECOND" "$THIRD"; do
    if stop_server "$pid"; then
        ok 'a server ends cleanly'
    else
        not_ok 'a server ends cleanly'
    fi
done
for data in a b c d e; do
    check "the data of $data are sound" "$SRNFD" check --data "$SCRATCH/$data"
done
done_testing
