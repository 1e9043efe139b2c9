#!/usr/bin/env bash
# The curl and Python lines of docs/covariates.md, run word for word on bodies that stand in for the ventricles, and that
# the surfaces that are predicted there have the sphericities that were asked for.
# srnfd-test: release-only (api/test_regress.sh runs its code)
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

# Bodies of revolution with a blunt end, as long as each other: sphericity goes with the square of the width. Those of one
# group are thicker at the blunt end.
export DATA=$SCRATCH/ventricles
mkdir "$DATA"
python3 - "$DATA" <<'PYTHON'
import math, random, sys

random.seed(5)
rows, columns, table = 14, 20, ['file,group,label,Sphericity,EF']
for i in range(16):
    width, mi = random.uniform(0.53, 0.74), i % 2
    noise = [random.gauss(0, 0.012) for _ in range(6)]
    points = []
    for k in range(rows + 1):
        theta = math.pi * k / rows
        for j in range(1 if k in (0, rows) else columns):
            phi = 2 * math.pi * j / columns
            r = width * math.sin(theta) * (1 + 0.15 * math.cos(theta) + 0.06 * mi * math.cos(theta) ** 3
                                           + sum(a * math.cos((n + 1) * phi + n) for n, a in enumerate(noise)))
            points.append((40 * r * math.cos(phi), 40 * r * math.sin(phi), 40 * math.cos(theta)))
    def at(k, j):
        return 0 if k == 0 else len(points) - 1 if k == rows else 1 + (k - 1) * columns + j % columns
    faces = []
    for k in range(rows):
        for j in range(columns):
            a, b, c, d = at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1)
            faces += [f for f in ((a, b, c), (a, c, d)) if len(set(f)) == 3]
    with open(f'{sys.argv[1]}/lv_{i:02}.off', 'w') as out:
        out.write(f'OFF\n{len(points)} {len(faces)} 0\n')
        out.writelines('%.6f %.6f %.6f\n' % p for p in points)
        out.writelines('3 %d %d %d\n' % f for f in faces)
    table.append(f'lv_{i:02}.off,{("ASYMP", "MI")[mi]},{mi},{100 * width ** 2:.3f},{random.uniform(35, 70):.3f}')
open(f'{sys.argv[1]}/labels.csv', 'w').write('\n'.join(table) + '\n')
PYTHON

start_server "$SCRATCH/data" || exit 1
run_documents docs/covariates.md
cd "$SCRATCH/clone" || exit 1

is "$(jq -c '[.members, .subjects, ([.terms[].name] | join(" "))]' fitted.json)" '[16,16,"Sphericity EF group"]' 'all members count'
is "$(jq -c '[.terms[:2][] | .pValue <= 0.001]' fitted.json)" '[true,false]' \
    'sphericity is found, and the ejection fraction, which says nothing, is not'
note "$(jq -c '.terms[] | [.name, .pValue, .r2]' fitted.json)"
is "$(jq '[.terms[], .model | .r2Interval[0] <= .r2 and .r2 <= .r2Interval[1]] | all' fitted.json)" true \
    'shares of the variance lie in their intervals'
is "$(wc -l <sphericities.txt)" 3 'three surfaces are predicted'
note "$(cat sphericities.txt)"
compare "$(awk '{ d = ($3 + 0) - ($5 + 0); if (d < 0) d = -d; if (d > most) most = d } END { print most + 0 }' sphericities.txt)" '<' 2 \
    'which have the sphericities that were asked for'
compare "$(sed -n '1s/.*measured \([0-9.]*\).*/\1/p' sphericities.txt)" '<' "$(sed -n '3s/.*measured \([0-9.]*\).*/\1/p' sphericities.txt)" \
    'and differ in them'
check 'one is written with its maps' grep -qa '^SCALARS confidence' round.vtk

if python3 -c 'import numpy' 2>/dev/null; then
    awk '/^```python$/ { on = 1; next } /^```$/ { on = 0 } on' "$ROOT/docs/covariates.md" >document.py
    if PYTHONPATH=$ROOT/clients/python/src SRNF_SERVER=$URL python3 -B document.py >"$SCRATCH/python" 2>"$SCRATCH/err"; then
        ok 'the lines of Python succeed'
    else
        not_ok 'the lines of Python succeed' "$(tail -n 12 "$SCRATCH/err")"
    fi
    is "$(tail -n 3 "$SCRATCH/python" | awk '{ printf "%.1f %.1f\n", $1, $2 }')" \
        "$(awk '{ printf "%.1f %.1f\n", $3, $5 }' sphericities.txt)" 'and measure the same'
else
    skip 'the lines of Python succeed' 'numpy is not installed'
fi

cd "$ROOT" || exit 1
stop_server || not_ok 'the server ends well'
done_testing
