#!/usr/bin/env bash
# test_trajectories.sh - trajectories end to end: planted growth and a group that grows faster in the units of the input,
# predicted surfaces, a subject that is odd, the same least squares by numpy on exported fields, and what is refused by
# name.
# srnfd-test: slow
# srnfd-test: no-asan (core/stats/test_trajectories.c and api/test_standard.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 2 || exit 1

# Ten subjects with bumps of their own, three visits each but one of four: z grows by 0.1 a year, in patients by 0.2, and
# in the last patient by 0.6.
python3 - "$URL" >"$SCRATCH/members.json" <<'PYTHON'
import json, math
from service import send

lmax = 4
def surface(subject, visit, z):
    rows = {axis: [0.0] * (lmax + 1) ** 2 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = 1.5, 1.2, z
    for axis in 'xyz':
        for k in range(4, 16):
            rows[axis][k] = 0.02 * math.sin(1.7 * subject * k + ord(axis) * k * k) + 0.002 * math.sin(visit * k * k + subject)
    return send('/v1/surfaces', {'coefficients': {'lmax': lmax, **rows}})['id']

def rate(s):
    return 0.6 if s == 9 else (0.1, 0.2)[s % 2]

members = [{'id': surface(s, t, 1.0 + rate(s) * t), 'subject': f's{s}', 'time': 60 + t, 'label': ('control', 'patient')[s % 2],
            'covariates': {'age': 50 + s * s % 7, 'same': 1}} for s in range(10) for t in range(4 if s == 3 else 3)]
print(json.dumps(members))
PYTHON
cohort() { # NAME FILTER
    curl -sS -X DELETE "$URL/v1/cohorts/$1" -o "$SCRATCH/ignored"
    jq -c "{name: \"$1\", members: ($2)}" "$SCRATCH/members.json" >"$SCRATCH/cohort.json"
    post_json /v1/cohorts "@$SCRATCH/cohort.json"
}
run() { # COHORT MORE PERMUTATIONS
    execute trajectories "{\"cohort\":\"$1\",\"register\":false,\"permutations\":${3:-99},\"bootstraps\":200${2:-}}"
}

cohort study .
is "$STATUS" 201 'a cohort of visits'
run study
is "$STATUS" 200 'has trajectories'
is "$(json '[.subjects, .members, .slope.permutations, .slope.exact, .weighted, .reference > 61] | tojson')" \
    '[10,31,99,false,true,true]' 'of ten subjects, one with four visits'
compare "$(json .slope.pValue)" '<=' 0.02 'they grow'
# z grows by r sqrt(3/(4 pi)) cos(theta): .0489 at the poles for .1 a year, in the mean of the ten here .19
compare "$(json '.slope.largestEffect - 0.0929 | fabs')" '<' 0.02 'as fast as planted, in the mean'
is "$(json '[.slope.rate, .slope.variation, .slope.individual, .slope.share | .value >= .interval[0] and .value <= .interval[1]] | all')" \
    true 'within its interval'
is "$(json '.slope | .distanceInterval[0] > 0 and .distanceInterval[0] < .distance and .distance < .distanceInterval[1]')" \
    true 'as that of the distance'
is "$(json '[(.surface.maps | length), (.terms | length), .model] | tojson')" '[8,0,null]' 'with eight maps and no terms'
is "$(json '.perSubject | max_by(.oddness | real) | [.subject, .percentile, .speedPercentile] | tojson')" '["s9",95,95]' \
    'the patient who grows fastest is the oddest'
is "$(json '[.perSubject[] | (.percentile >= .percentileInterval[0] and .percentile <= .percentileInterval[1] and
    .speedPercentile >= .speedPercentileInterval[0] and .speedPercentile <= .speedPercentileInterval[1])] | all')" true \
    'within intervals of the percentiles'
compare "$(json '.perSubject[9].speed | real')" '>' 3 'three times as fast as the others'

cohort dated 'map(.time = 20200000 + (.time - 60) * 10000 + 228)'
run dated '' 9
is "$STATUS $(json '[.warnings[] | select(.code == "covariate-is-date") | .figures | [.covariate, .format, .first, .last]] | tojson')" \
    '200 [["time","YYYYMMDD",20200228,20230228]]' 'times that are days as numbers are warned of'

cohort collinear 'map(.covariates.year = 2000 - 3 * .covariates.age + (.subject[1:] | tonumber) % 2)'
run collinear ',"formula":"shape ~ age + year"' 9
is "$STATUS $(json '[.warnings[] | select(.code == "covariates-collinear") | .figures | [.term, .covariate]] | tojson')" \
    '200 [["age","year"]]' 'covariates of subjects that tell each other are warned of'

cohort usual 'map(select(.subject != "s9" and .subject != "s8"))'
run usual ',"formula":"shape ~ group","fields":true,"at":[{"time":60},{"time":62},{"time":60,"group":"patient"},{"time":62,"group":"patient"}]' 999
is "$STATUS" 200 'by group'
cp "$BODY" "$SCRATCH/groups.json"
is "$(json '[.terms[0].name, (.terms[0].level), (.coefficients | length), (.predictions | length), .predictions[3].at.time] | tojson')" \
    '["group","asymptotic",2,4,62]' 'a term, two coefficients and four predictions'
compare "$(json '.terms[0].pValue')" '<=' 0.05 'the groups differ'
compare "$(json '.coefficients[1].largestEffect - 0.0489 | fabs')" '<' 0.012 'as planted'
is "$(json '[.predictions[].relativeEnergy < 0.001] | all')" true 'surfaces are predicted'
is "$(json '[.predictions[0].surface.maps[]] | sort | join(" ")')" \
    'confidence slope slopeConfidence slopeError standardError' 'with five maps'
get "/v1/surfaces/$(json '.predictions[3].surface.id')/coefficients"
compare "$(json '.z[2] / .x[3] - 1.4 / 1.5 | fabs')" '<' 0.03 'patients after two years are as long as planted'
get "/v1/surfaces/$(jq -r '.predictions[0].surface.id' "$SCRATCH/groups.json")/mesh?format=ply"
is "$STATUS" 200 'and travel as meshes'

# The same least squares on exported fields: surfaces as they are, so that fields are those of the surfaces, times what
# the group's scale makes of each.
if /usr/bin/python3 -c 'import numpy' 2>/dev/null; then
    /usr/bin/python3 - "$URL" "$SCRATCH" >"$SCRATCH/parity" <<'PYTHON'
import io, json, sys, urllib.request
import numpy as np

url, scratch = sys.argv[1:]
result = json.load(open(scratch + '/groups.json'))
members = json.load(open(scratch + '/cohort.json'))['members']
n_theta, n_phi = np.array(result['terms'][0]['map']['nTheta']), result['terms'][0]['map']['nPhi']

def get(path):
    return json.load(urllib.request.urlopen(url + path))

q, times, weights = [], [], None
scales = []
for one in members:
    field = get(f"/v1/surfaces/{one['id']}/srnf?nTheta={n_theta}")
    scales.append(get(f"/v1/surfaces/{one['id']}")['scale'])
    weights = np.repeat(np.array(field['weights']), n_phi)
    q.append(np.array(field['values']).reshape(-1, 3))
q = np.array(q) * np.array(scales)[:, None, None] / np.mean(scales)
subjects = list(dict.fromkeys(one['subject'] for one in members))
slopes, spread, left, freedom = [], [], 0.0, 0
for name in subjects:
    own = [i for i, one in enumerate(members) if one['subject'] == name]
    t = np.array([members[i]['time'] for i in own], float)
    design = np.stack([np.ones(len(t)), t - t.mean()], 1)
    fit, *_ = np.linalg.lstsq(design, q[own].reshape(len(own), -1), rcond=None)
    off = (q[own].reshape(len(own), -1) - design @ fit).reshape(len(own), -1, 3)
    left += (off ** 2 * weights[None, :, None]).sum()
    freedom += len(own) - 2
    slopes.append(fit[1])
    spread.append(((t - t.mean()) ** 2).sum())
slopes, spread = np.array(slopes), np.array(spread)
x = np.stack([np.ones(len(subjects)), [next(one['label'] == 'patient' for one in members if one['subject'] == s) for s in subjects]], 1)
within = left / freedom
norm2 = lambda v: (v.reshape(len(v), -1, 3) ** 2 * weights[None, :, None]).sum()
def squares(between):  # Paule and Mandel's: the degrees of freedom on average
    root = np.sqrt(1 / (between + within / spread))[:, None]
    orthonormal, _ = np.linalg.qr(x * root)
    return norm2(slopes * root - orthonormal @ (orthonormal.T @ (slopes * root)))
between, most = 0.0, norm2(slopes)
if squares(0.0) > len(x) - 2:
    for _ in range(100):
        middle = (between + most) / 2
        between, most = (middle, most) if squares(middle) > len(x) - 2 else (between, middle)
w = 1 / (between + within / spread)
w /= w.mean()
b, *_ = np.linalg.lstsq(x * np.sqrt(w)[:, None], slopes * np.sqrt(w)[:, None], rcond=None)
theirs = np.array([np.array(c['q']).ravel() for c in result['coefficients']])
print(np.abs(theirs - b).max() / np.abs(b).max())
print(abs(result['within'] / within - 1), abs(result['between'] / between - 1) if between else 0.0)
print(np.abs(w - [s['weight'] for s in result['perSubject']]).max())
PYTHON
    is "$(wc -w <"$SCRATCH/parity")" 4 'numpy fits the same'
    while read -r figures; do
        for figure in $figures; do
            compare "$figure" '<' 1e-10 'to rounding'
        done
    done <"$SCRATCH/parity"
else
    skip 'parity with numpy' 'no numpy'
fi

refused() { # COHORT-FILTER PATTERN MORE
    cohort wrong "$1"
    run wrong "${3:-}"
    like "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" "$2" "refused: $2"
}
refused 'del(.[1:3])' '422 /inputs/cohort subject "s0" has one visit, member 0; a slope needs two'
refused '.[0:3] |= map(.time = 7)' 'all visits of subject "s0" are at one time, as member 0; a slope needs two'
refused 'del(.[4].time)' 'member 4 .surf-[0-9a-f]*, of subject "s1". has no time, or one that is no number: give it one in the cohort, in the same unit'
refused 'del(.[4].subject)' 'member 4 .surf-.* has no subject'
refused '.[0:12]' 'has 4 subjects; 5 are needed'
refused 'map(if .subject == "s2" then .label = "rare" else . end)' '/inputs/formula level "rare" of "group" has one subject' \
    ',"formula":"shape ~ group"'
refused . '/inputs/formula "same" is the same for all members' ',"formula":"shape ~ same"'
refused '.[5].covariates = {}' '/inputs/formula 1 of 31 members have no "age", member 5' ',"formula":"shape ~ age"'
refused . '/inputs/formula has time, which slopes are of already' ',"formula":"shape ~ time"'
refused . '/inputs/formula must be a formula' ',"formula":7'
refused . '/inputs/at/0 needs a time, a number' ',"at":[{"time":"soon"}]'
refused . '/inputs/at/1 has more than a time, and there is no formula' ',"at":[{"time":1},{"time":1,"age":3}]'
refused . '/inputs/at/0/size "size" is no covariate of the formula' ',"formula":"shape ~ age","at":[{"time":1,"size":3}]'
refused '.[1].time = 1e160' '/inputs/cohort member [0-9]+ .surf-.* is at the time 60 and member 1 .surf-.* at 1e.160, more than 1e.30 apart: give times in a larger unit'
refused '.[0:3] |= (.[0].time = 0 | .[1].time = 1e-100 | .[2].time = 0)' \
    'subject "s0", member 0, is seen from the time 0 to 1e-100, less than 1e-30: give times in a smaller unit'
refused . '/inputs/at/1/time is 1e.308, more than 1e.06 times the span of the visits, 60 to [0-9.]+, away from them' \
    ',"at":[{"time":61},{"time":1e308}]'
run study ',"at":[{"time":80}]'
is "$(json '[.warnings[] | select(.code == "extrapolated")] | length')" 1 'a time beyond the visits is told'

# What a table looks like that is mistaken: every one is told by the names of subjects.
doubts() { # FILTER PATTERN WHAT
    cohort doubtful "map(select(.subject != \"s9\")) | $1"
    run doubtful
    like "$STATUS $(json '[.warnings[] | select(.code | test("^(slope|spans|visits)-")) | "\(.code) \(.figures.subjects // .figures.members | join(",")): \(.detail)"] | join(" | ")')" \
        "$2" "$3"
}
doubts . '^200 $' 'a sound table has none of these warnings'
doubts '.[1].time = .[0].time' '^200 visits-coincide s0: Two visits of one subject are at the same time, 60: s0 .* and s0 .*' \
    'a time that is there twice'
doubts '.[0:3] |= map(.time = -.time)' 'slope-reversed s0: Subject "s0" changes against all' 'visits in reversed order'
doubts 'map(if .subject == "s2" or .subject == "s5" then .time *= 365 else . end)' \
    'spans-differ s2,s5: Times may be in different units: .* subject "s2" .and 1 more subject. takes 730 to 730, the 7 others 2 to 3' \
    'times in days among years'
doubts 'map(if .subject == "s2" then .time *= 12 else . end)' 'spans-differ s2: ' 'times in months among years'
doubts '.[0].subject = "s2" | .[6].subject = "s0"' 'visits-exchanged s0 .*,s2 .*seem exchanged' 'visits exchanged between subjects'
doubts '.[7].time = 1000' 'visits-off-line s2: The 3 visits of subject "s2"' 'a visit that is off the line of its subject'
cohort study .
run study ',"formula":"shape ~ group"'
like "$(json '[.warnings[] | select(.code == "slope-odd") | "\(.figures.subjects[0]) \(.detail)"] | join(" ")')" \
    '^s9 The slope of subject "s9" is [0-9.]+ times as far' 'a subject that is unlike all others'

# Neither the order of the members nor the poses that surfaces lie in say anything of a subject.
result() { json 'del(.seconds, .inputs, .jobID, .links, .model.created) | del(.. | .id?, .created?, .links?, .source?) | tojson'; }
cohort usual 'map(select(.subject != "s9"))'
run usual ',"formula":"shape ~ group","fields":true'
result >"$SCRATCH/forward"
cohort usual 'map(select(.subject != "s9")) | reverse'
run usual ',"formula":"shape ~ group","fields":true'
is "$(result | cmp - "$SCRATCH/forward" 2>&1)" '' 'in another order they are the same, bit for bit'
python3 - "$URL" >"$SCRATCH/members.json" <<'PYTHON'
import json, math, random
from service import send

def turn(seed):
    w, x, y, z = [random.Random(4 * seed + k).gauss(0, 1) for k in range(4)]
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]

def surface(pose, time):
    rows = {axis: [0.0] * 36 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = 1.5 + 0.1 * time, 1.2, 1.0
    for axis in 'xyz':
        for k in range(4, 16):
            rows[axis][k] = 0.1 * math.sin(ord(axis) * k * k)
    old = [rows[axis] for axis in 'xyz']
    turned = {axis: [sum(r * old[j][k] for j, r in enumerate(row)) for k in range(36)] for axis, row in zip('xyz', turn(pose))}
    return send('/v1/surfaces', {'coefficients': {'lmax': 5, **turned}})['id']

print(json.dumps([{'id': surface(s, t), 'subject': f's{s}', 'time': t} for s in range(6) for t in range(3)]))
PYTHON
cohort posed .
run posed
compare "$(json '[.perSubject[].length] | max / min - 1')" '<' 1e-6 'in other poses a subject changes as fast'

stop_server || not_ok 'the server ends well'
done_testing
