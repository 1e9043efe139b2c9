#!/usr/bin/env bash
# Wrong inputs: each is answered with the status and the code that the contract names, with the element in its
# detail, and after each the service still answers. Meshes that parse but cannot be analysed are kept, their report
# says why, and encode refuses them with the same code.
# srnfd-test: slow
# srnfd-test: once (what is refused does not depend on the build)
. "$(dirname "$0")/../support/lib.sh"

THALAMUS=tests/data/aal_subcortex/L_thalamus.ply
MESHES=$SCRATCH/meshes
mkdir "$MESHES"

# ---- Meshes --------------------------------------------------------------------------------------------

# A torus (or with TWIST=1 a Klein bottle) of N x N vertices, as OFF.
torus() { # N TWIST
    awk -v n="$1" -v twist="$2" 'BEGIN {
        pi = 3.14159265358979
        print "OFF"
        print n * n, 2 * n * n, 0
        for (i = 0; i < n; i++) for (j = 0; j < n; j++) {
            u = 2 * pi * i / n; v = 2 * pi * j / n
            print (3 + cos(v)) * cos(u), (3 + cos(v)) * sin(u), sin(v) + 0.01 * sin(u + 2 * v)
        }
        for (i = 0; i < n; i++) for (j = 0; j < n; j++) {
            k = (j + 1) % n; a = i * n + j; b = i * n + k
            if (i < n - 1) { c = (i + 1) * n + j; d = (i + 1) * n + k }
            else if (twist) { c = (n - j) % n; d = (n - k) % n }
            else { c = j; d = k }
            print 3, a, c, b
            print 3, b, c, d
        }
    }'
}

# An octahedron at X, its indices from BASE; one face left out where HOLE is 1. Two parts: "v" and "f" lines.
octahedron() { # X BASE HOLE
    awk -v x="$1" -v b="$2" -v hole="$3" 'BEGIN {
        print "v", x + 1, 0, 0; print "v", x - 1, 0, 0; print "v", x, 1, 0
        print "v", x, -1, 0; print "v", x, 0, 1; print "v", x, 0, -1
        n = split("1 3 5 3 2 5 2 4 5 4 1 5 3 1 6 2 3 6 4 2 6 1 4 6", f, " ")
        for (i = 1; i <= n - 3 * hole; i += 3) print "f", b + f[i], b + f[i + 1], b + f[i + 2]
    }'
}

torus 12 0 >"$MESHES/torus.off"
torus 12 1 >"$MESHES/klein.off"
octahedron 0 0 0 >"$MESHES/sphere.obj"
octahedron 0 0 1 >"$MESHES/hole.obj"
{
    octahedron 0 0 0
    octahedron 5 6 0
} >"$MESHES/two.obj"
# Two octahedra that touch in one vertex: both use the vertex (1, 0, 0), number 1.
{
    octahedron 0 0 0
    octahedron 2 6 0 | sed -e '/^f/s/\b8\b/1/g'
} >"$MESHES/fan.obj"
# One face turned around.
octahedron 0 0 0 | sed 's/^f 1 3 5$/f 3 1 5/' >"$MESHES/turned.obj"
# A third face on an edge.
{
    octahedron 0 0 0
    echo 'v 2 2 2'
    echo 'f 1 3 7'
} >"$MESHES/fin.obj"
# No volume: a triangle and its back.
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n' >"$MESHES/flat.obj"
octahedron 0 0 0 | sed '2s/.*/v nan 0 0/' >"$MESHES/nan.obj"
octahedron 0 0 0 | sed '$s/.*/f 1 4 60/' >"$MESHES/range.obj"
printf 'ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1000000000\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n' >"$MESHES/promise.ply"
printf '<!DOCTYPE html>\n<html><body>404</body></html>\n' >"$MESHES/page.html"
: >"$MESHES/empty"
head -c 300 /dev/urandom >"$MESHES/noise.bin"

# The beginning of a file of each format.
head -c 3000 "$THALAMUS" >"$MESHES/cut.ply"
torus 12 0 | head -n 100 >"$MESHES/cut.off"
printf 'v 0 0 0\nv 1 0 0\nv 0 1\n' >"$MESHES/cut.obj"
{
    head -c 80 /dev/zero
    printf '\x64\0\0\0'
    head -c 120 /dev/zero
} >"$MESHES/cut.stl"
printf '# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 10 float\n0 0 0 1\n' >"$MESHES/cut.vtk"
printf '<?xml version="1.0"?>\n<GIFTI Version="1.0" NumberOfDataArrays="2">\n<DataArray Intent="NIFTI_INTENT_POINTSET"' >"$MESHES/cut.gii"
printf '\xff\xff\xfecreated by\n\n\0\0\0\x64\0\0\0\xc8\0\0' >"$MESHES/cut.freesurfer"

alive_still() { # NAME
    request GET /healthz
    is "$STATUS" 200 "after $1 the service answers"
}

# A body that is refused, and is not kept.
refused() { # NAME QUERY STATUS CODE DETAIL-REGEX [CURL ARGUMENTS..]
    local name=$1 query=$2 status=$3 code=$4 detail=$5
    shift 5
    post "/v1/meshes$query" "$@"
    is_problem "$status" "$code" "$name: $status $code"
    like "$(json .detail)" "$detail" "$name: the detail says where"
    alive_still "$name"
}

# A mesh that is kept with a problem, and that encode refuses with the same code.
flawed() { # FILE CODE DETAIL-REGEX
    local id
    post "/v1/meshes?name=$1" --data-binary "@$MESHES/$1"
    is "$STATUS" 201 "$1 is kept"
    is "$(json .report.analysable)" false "$1: the report says that it cannot be analysed"
    like " $(json '.report.problems | map(.code) | join(" ")') " " $2 " "$1: and why: $2"
    like "$(json ".report.problems[] | select(.code == \"$2\") | \"\(.count) \(.first) \(.detail)\"")" "$3" \
        "$1: with the element"
    id=$(json .id)
    code=$(json '.report.problems[0].code')
    execute encode "{\"mesh\":\"$id\"}"
    is_problem 422 "$code" "$1: encode refuses it with the first of its codes"
    like "$(json .detail)" "$id|[0-9]" "$1: and says which"
    alive_still "$1"
}

start_server "$SCRATCH/data" --workers 1 --max-body 2000000 || exit 1

flawed torus.off not-genus-zero '1'
flawed hole.obj mesh-not-closed '3 [0-9]+'
flawed two.obj multiple-components '2'
flawed klein.off mesh-not-oriented '[0-9]+ [0-9]+'
flawed fan.obj mesh-not-manifold '1 [0-9]+'
flawed turned.obj mesh-not-oriented '3 [0-9]+'
flawed fin.obj mesh-not-manifold '1 [0-9]+'
flawed flat.obj mesh-degenerate '.'

refused 'NaN' '?format=obj' 422 unparsable-mesh '[0-9]' --data-binary "@$MESHES/nan.obj"
refused 'an index out of range' '?format=obj' 422 unparsable-mesh '60|[0-9]' --data-binary "@$MESHES/range.obj"
refused '10^9 faces promised' '?format=ply' 422 unparsable-mesh '1000000000|face' --data-binary "@$MESHES/promise.ply"
refused 'an HTML page' '' 422 unparsable-mesh 'web page' --data-binary "@$MESHES/page.html"
refused 'an HTML page that says so' '' 415 unsupported-media-type 'text/html' \
    -H 'Content-Type: text/html' --data-binary "@$MESHES/page.html"
refused 'an empty body' '' 422 unparsable-mesh 'empty' --data-binary "@$MESHES/empty"
printf 'OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' >"$MESHES/whole.off"
refused 'a file that curl -d has made one line' '' 422 unparsable-mesh '; the body has no line ends: curl -d takes them out' \
    --data "@$MESHES/whole.off"
refused 'noise' '' 422 unparsable-mesh 'format' --data-binary "@$MESHES/noise.bin"
for format in ply off obj stl vtk gii freesurfer; do
    refused "a truncated $format" "?format=$format" 422 unparsable-mesh '[0-9]|end|truncated' \
        --data-binary "@$MESHES/cut.$format"
done
refused 'an unknown format' '?format=docx' 422 invalid-input 'docx' --data-binary "@$THALAMUS"
post '/v1/meshes?format=docx' --data-binary "@$THALAMUS"
is "$(json '.errors[0].pointer')" /format 'an unknown format is pointed at'
DESCRIBED=$(sed -n 's/.*"enum"//; /^    MeshFormat:/,/]}/p' api/openapi.yaml | grep -o '"[a-z0-9-]*"' | sort | xargs)
is "$(json '.errors[0].detail' | sed 's/^format must be //; s/, not .*//; s/ or /, /; s/, /\n/g' | sort | xargs)" "$DESCRIBED" \
    'and those that the description has are listed'
printf '<?xml version="1.0"?>\n<VTKFile type="ImageData">' >"$SCRATCH/new.vtp"
refused 'another XML format of VTK' '' 422 unparsable-mesh 'extract the surface.*vtp' --data-binary "@$SCRATCH/new.vtp"
gzip -c "$THALAMUS" | head -c 5000 >"$SCRATCH/mesh.gz"
refused 'what gzip packed, cut short' '' 422 unparsable-mesh 'gzip file is cut' --data-binary "@$SCRATCH/mesh.gz"
gzip -c "$THALAMUS" | gzip -c >"$SCRATCH/mesh.gz.gz"
refused 'what gzip packed twice' '' 422 unparsable-mesh 'unpack it once' --data-binary "@$SCRATCH/mesh.gz.gz"
{ head -c 344 /dev/zero && printf 'n+1\0' && head -c 100 /dev/zero; } >"$SCRATCH/volume.nii"
refused 'a volume' '' 422 unparsable-mesh 'volume.*POST it to /v1/volumes' --data-binary "@$SCRATCH/volume.nii"
printf 'PK\003\004 and more' >"$SCRATCH/meshes.zip"
refused 'an archive' '' 422 unparsable-mesh 'this is a zip archive: .*/v1/imports' --data-binary "@$SCRATCH/meshes.zip"
refused 'an archive that is named a mesh' '?format=ply' 422 unparsable-mesh 'this is a zip archive: .*/v1/imports' \
    --data-binary "@$SCRATCH/meshes.zip"
printf '%%PDF-1.7' >"$SCRATCH/paper.pdf"
refused 'a document' '' 422 unparsable-mesh 'PDF' --data-binary "@$SCRATCH/paper.pdf"
head -c 80 /dev/zero >"$SCRATCH/cut.stl"
printf '\004\000\000\000' >>"$SCRATCH/cut.stl"
head -c 120 /dev/zero >>"$SCRATCH/cut.stl"
refused 'binary STL that is cut short' '' 422 unparsable-mesh 'STL.*number of triangles' --data-binary "@$SCRATCH/cut.stl"
refused 'a form' '' 415 unsupported-media-type 'no form.*octet-stream' --form "mesh=@$THALAMUS"
refused 'the wrong format' '?format=stl' 422 unparsable-mesh '.' --data-binary "@$THALAMUS"
refused 'an unknown query parameter' '?fromat=ply' 400 unknown-parameter 'known: format,name' --data-binary "@$THALAMUS"
refused 'a query parameter in another case' '?Format=ply' 400 unknown-parameter 'Format' --data-binary "@$THALAMUS"
refused 'a parameter given twice' '?format=ply&format=obj' 400 malformed-request 'format' --data-binary "@$THALAMUS"
refused 'a broken escape' '?name=%zz' 400 malformed-request 'name' --data-binary "@$THALAMUS"
head -c 2000001 /dev/zero >"$MESHES/big"
refused 'a body beyond the limit' '' 413 body-too-large '2000000' --data-binary "@$MESHES/big"
refused 'the same in chunks' '' 413 body-too-large 'limit' -H 'Transfer-Encoding: chunked' --data-binary "@$MESHES/big"
get /v1/meshes
is "$(json '.items | length')" 8 'only what parses is kept'

# ---- Requests --------------------------------------------------------------------------------------------

request PUT /v1/meshes
is_problem 405 method-not-allowed 'a method that is not there'
is "$(header Allow)" 'POST, GET, HEAD, OPTIONS' 'and those that are'
get /v1/nothing
is_problem 404 not-found 'a path that is not there'
get /v1/meshes/mesh-00000000000000000000000000000000
is_problem 404 no-such-mesh 'an unknown mesh'
get "/v1/meshes/%27%20OR%201=1"
is_problem 404 no-such-mesh 'an id that is none'
get /v1/jobs/job-00000000-0000-7000-8000-000000000000
is_problem 404 no-such-job 'an unknown job'
get /v1/jobs/job-00000000-0000-7000-8000-000000000000/results
is_problem 404 no-such-job 'results of an unknown job'
request DELETE /v1/jobs/x
is_problem 404 no-such-job 'an unknown job to remove'
post /v1/jobs/x/cancel
is_problem 404 no-such-job 'an unknown job to cancel'
get /v1/processes/fly
is_problem 404 no-such-process 'an unknown process'
execute fly '{}'
is_problem 404 no-such-process 'an unknown process to run'
get /v1/meshes -H 'Accept: text/html'
is_problem 406 not-acceptable 'a representation that is not there'
get '/v1/meshes?limit=0'
is_problem 422 invalid-input 'a limit out of range'
get /v1/processes
for process in $(json '.processes[].id'); do
    post_json "/v1/processes/$process/execution" '{"inputs":{"unheard-of":1}}'
    like "$(json '.errors[] | select(.pointer == "/inputs/unheard-of") | .detail')" \
        '^this process has no such input\. Known: [a-z]' "$process tells which inputs it has"
done
post_json /v1/processes/distances/execution '{"inputs":{"surfcaes":[]}}'
like "$(json '.errors[] | select(.pointer == "/inputs/surfcaes") | .detail')" \
    'did you mean surfaces\? Known: surfaces, cohort, mixedRoutes, register, metric' 'and which one may be meant'
post_json /v1/processes/distance/execution '{"inputs":{}}'
is_problem 404 no-such-process 'a process that is not there'
like "$(json .detail)" 'did you mean distances\? Known: extract, ' 'and which one may be meant'
get '/v1/meshes?cursor=abc'
is_problem 422 invalid-input 'an invented cursor'
get '/v1/jobs?status=done'
is_problem 422 invalid-input 'a state that is none'
alive_still 'wrong requests'

# ---- Executions ------------------------------------------------------------------------------------------

post "/v1/meshes?format=ply" --data-binary "@$THALAMUS"
mesh=$(json .id)

invalid() { # NAME INPUTS POINTER
    execute encode "$2"
    is_problem 422 invalid-input "$1"
    is "$(json '.errors[0].pointer')" "$3" "$1: is pointed at"
    like "$(json .detail)" "$3" "$1: in the detail, too"
}

post_json /v1/processes/encode/execution '{"inputs":'
is_problem 400 malformed-json 'malformed JSON'
like "$(json .detail)" 'line 1' 'with its line'
post_json /v1/processes/encode/execution "{\"inputs\":{\"mesh\":\"$mesh\",\"mesh\":\"$mesh\"}}"
is_problem 400 malformed-json 'a member that is named twice'
post_json /v1/processes/encode/execution '[1]'
is_problem 400 malformed-json 'an array where an object is wanted'
post_json /v1/processes/encode/execution "$(head -c 100000 /dev/zero | tr '\0' '[')"
is_problem 400 malformed-json 'a hundred thousand brackets'
post_json /v1/processes/encode/execution ''
is_problem 400 malformed-json 'an empty body'
post /v1/processes/encode/execution -H 'Content-Type: text/plain' --data-binary '{"inputs":{}}'
is_problem 415 unsupported-media-type 'another media type'
post_json /v1/processes/encode/execution '{"input":{}}'
is_problem 422 invalid-input 'an unknown member of the body'
is "$(json '[.errors[].pointer] | join(" ")')" '/input /inputs' 'and the one that is missing'
execute encode '{}'
is_problem 422 invalid-input 'an input that is missing'
like "$(json .detail)" 'mesh' 'is named'
invalid 'an unknown input' "{\"mesh\":\"$mesh\",\"lmx\":15}" /inputs/lmx
invalid 'a degree that is too high' "{\"mesh\":\"$mesh\",\"lmax\":128}" /inputs/lmax
invalid 'a degree that is too low' "{\"mesh\":\"$mesh\",\"lmax\":3}" /inputs/lmax
invalid 'a degree that is a string' "{\"mesh\":\"$mesh\",\"lmax\":\"31\"}" /inputs/lmax
invalid 'a degree that is no integer' "{\"mesh\":\"$mesh\",\"lmax\":15.5}" /inputs/lmax
invalid 'a scale that is not known' "{\"mesh\":\"$mesh\",\"scale\":\"metric\"}" /inputs/scale
invalid 'a centre with two coordinates' "{\"mesh\":\"$mesh\",\"center\":[0,1]}" /inputs/center
invalid 'a smoothing that is negative' "{\"mesh\":\"$mesh\",\"smoothing\":-1}" /inputs/smoothing
execute encode '{"mesh":"mesh-00000000000000000000000000000000"}'
like "$STATUS $(json .code)" '^(404 no-such-mesh|422 invalid-input)$' 'an unknown mesh to encode'
like "$(json .detail)" 'mesh-00000000000000000000000000000000|/inputs/mesh' 'is named'
get /v1/jobs
is "$(json '.jobs | length')" 0 'none of them became a job'

# Only the computation finds this out.
post "/v1/meshes?format=ply" --data-binary "@tests/data/aal_subcortex/L_caudate.ply"
execute encode "{\"mesh\":\"$(json .id)\",\"parameterization\":\"star\"}"
is "$STATUS $(json .code)" '422 not-star-shaped' 'the route star on a mesh that is not star-shaped'
like "$(json .detail)" '[0-9.]+ %' 'with the area that is seen from behind'
alive_still 'wrong executions'

stop_server || not_ok 'the server ends well'
done_testing
