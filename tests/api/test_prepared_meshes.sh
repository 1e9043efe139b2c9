#!/usr/bin/env bash
# test_prepared_meshes.sh - a mesh is prepared at its upload: every job that needs it finds it so, also after a restart,
# and answers as if it had prepared it. Its mirror image, and the mesh with a sphere, are prepared at first need.
# srnfd-test: no-asan (fuzz/test_api.sh and api/test_encoding_guard.sh run its code)
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
meshes() { # made and kept since the start of the server
    get /metrics
    sed -n 's/^srnfd_meshes_total{source="\(.*\)"} \(.*\)/\1 \2/p' "$BODY" | sort -r | tr '\n' ' '
}
upload() { # FILE
    post /v1/meshes --data-binary "@$1"
    json .id
}
encode() { # INPUTS: prints the figures
    get '/v1/jobs?process=encode'
    for id in $(json '.jobs[].id'); do
        request DELETE "/v1/jobs/$id"
    done
    execute encode "$1"
    json '[.status, .code, .detail, .fit, .distortion, .warnings, (.surface | del(.source, .created))?] | tojson'
}
some_encodings() { # the figures of each kind of them
    encode "{\"mesh\":\"$A\",\"lmax\":8}"
    encode "{\"mesh\":\"$A\",\"lmax\":8,\"parameterization\":\"star\"}"
    encode "{\"mesh\":\"$A\",\"lmax\":8,\"mirror\":true}"
    encode "{\"mesh\":\"$A\",\"lmax\":7,\"mirror\":true}"
    encode "{\"mesh\":\"$A\",\"sphere\":\"$S\",\"parameterization\":\"given\",\"lmax\":8}"
    encode "{\"mesh\":\"$A\",\"sphere\":\"$S\",\"parameterization\":\"given\",\"lmax\":7}"
    encode "{\"mesh\":\"$SINGLE\",\"lmax\":8}"
}

# A bumpy sphere, the sphere that its rays go to, and the mesh with a face less.
python3 - "$SCRATCH" <<'PYTHON'
import math, sys
points = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
for _ in range(4):
    middle, finer = {}, []
    def between(a, b):
        if (min(a, b), max(a, b)) not in middle:
            sum_ = [x + y for x, y in zip(points[a], points[b])]
            points.append(tuple(x / math.hypot(*sum_) for x in sum_))
            middle[min(a, b), max(a, b)] = len(points) - 1
        return middle[min(a, b), max(a, b)]
    for a, b, c in faces:
        d, e, f = between(a, b), between(b, c), between(c, a)
        finer += [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
    faces = finer
def write(name, points, faces):
    with open(f"{sys.argv[1]}/{name}.off", "w") as out:
        out.write(f"OFF\n{len(points)} {len(faces)} 0\n")
        out.writelines("%.17g %.17g %.17g\n" % tuple(p) for p in points)
        out.writelines("3 %d %d %d\n" % f for f in faces)
bumpy = [[(1 + 0.2 * x * y + 0.1 * z) * v + 3 for v in (x, y, z)] for x, y, z in points]
write("mesh", bumpy, faces)
write("sphere", points, faces)
write("open", bumpy, faces[1:])
PYTHON

start_server "$DATA" || exit 1
A=$(upload "$SCRATCH/mesh.off")
S=$(upload "$SCRATCH/sphere.off")
upload "$SCRATCH/open.off" >/dev/null
SINGLE=$(upload tests/data/aal_subcortex/L_pallidum.ply)
is "$(meshes)" '' 'nothing was needed yet'
FIRST=$(some_encodings)
is "$(meshes)" 'made 2 kept 5 ' 'what the upload prepared is found; mirror image and pair are prepared once'
is "$(find "$DATA/prepared" -type f | wc -l)" 5 'each is one file; a mesh with problems, of which nothing is computed, has none'
stop_server

for bytes in 1073741824 0; do # found again after a restart, and with nothing kept
    sqlite3 "$DATA/srnfd.db" 'DELETE FROM encoding'
    start_server "$DATA" --kept-meshes "$bytes" || exit 1
    is "$(some_encodings)" "$FIRST" "the answers are the same to the last bit with $bytes bytes"
    is "$(meshes)" "$([ "$bytes" = 0 ] && echo 'made 7 ' || echo 'kept 7 ')" 'of meshes that are kept, or not'
    stop_server
done
is "$(find "$DATA/prepared" -type f | wc -l)" 0 'without room nothing stays'

sqlite3 "$DATA/srnfd.db" 'DELETE FROM encoding'
start_server "$DATA" || exit 1
encode "{\"mesh\":\"$A\",\"lmax\":8}" >/dev/null
is "$(meshes)" 'made 1 ' 'a mesh that was not kept is prepared at first need'
stop_server
find "$DATA/prepared" -type f -exec sh -c 'printf x | dd of="$1" bs=1 seek=500 conv=notrunc status=none' - {} \;
sqlite3 "$DATA/srnfd.db" 'DELETE FROM encoding'
is "$("$SRNFD" check --data "$DATA" | grep -c '^orphan: prepared/')" 1 'a damaged one is waste, and no damage'
start_server "$DATA" || exit 1
is "$(some_encodings)" "$FIRST" 'what is damaged decides nothing'
"$SRNFD" backup "$SCRATCH/backup" --data "$DATA" >/dev/null
isnt "$(ls "$DATA/prepared")" '' 'it is kept again'
is "$(ls -d "$SCRATCH/backup/prepared" 2>/dev/null)" '' 'a backup does without'
stop_server
start_server "$SCRATCH/backup" || exit 1
sqlite3 "$SCRATCH/backup/srnfd.db" 'DELETE FROM encoding'
is "$(some_encodings)" "$FIRST" 'and answers the same'
done_testing
