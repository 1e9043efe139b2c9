#!/usr/bin/env bash
# test_paired.sh - change between two visits and asymmetry of two sides end to end: planted differences in the units of
# the input, p by flips, times and sides that are told apart, and what is refused by name.
# srnfd-test: slow
# srnfd-test: no-asan (core/stats/test_paired.c and api/test_standard.sh run its code)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400
WAIT='Prefer: wait=300' # however busy the machine is

start_server "$SCRATCH/data" --workers 2 || exit 1

# Six subjects with bumps of their own, at times 0, 1 and 2: z grows by 0.2 from 0 to 1. And six with two sides, mirror
# images but that x is longer by 0.2 on the right.
python3 - "$URL" >"$SCRATCH/members.json" <<'PYTHON'
import json, math
from service import send

lmax = 4
def surface(subject, visit, x, z, mirror=False, turn=0):
    rows = {axis: [0.0] * (lmax + 1) ** 2 for axis in 'xyz'}
    for axis, k, radius in (('x', 2, x), ('y', 0, 1.2), ('z', 1, z)):
        rows[axis][1 + (k + turn) % 3] = radius
    for axis in 'xyz':
        for k in range(4, 16):
            rows[axis][k] = 0.02 * math.sin(1.7 * subject * k + ord(axis) * k * k) + 0.004 * math.sin(visit * k + subject)
    if mirror:  # x to -x, on the surface and on the sphere: cosines of odd order turn their sign there
        for axis in 'xyz':
            for l in range(lmax + 1):
                for m in range(-l, l + 1):
                    sphere = -1 if (m > 0 and m % 2) or (m < 0 and m % 2 == 0) else 1
                    rows[axis][l * l + l + m] *= sphere * (-1 if axis == 'x' else 1)
    return send('/v1/surfaces', {'coefficients': {'lmax': lmax, **rows}})['id']

visits = [{'id': surface(s, t, 1.5, 1.0 + 0.2 * (t > 0)), 'subject': f's{s}', 'time': t} for s in range(6) for t in range(3)]
sides = [{'id': surface(s, t, 1.5 + 0.2 * t, 1.0, t == 1), 'subject': f's{s}', 'side': ('left', 'right')[t]}
         for s in range(6) for t in range(2)]
# The same, parameterized so differently that no inversion finds them from their mean on.
turned = [{'id': surface(s, t, 1.5 + 0.2 * t, 1.0, t == 1, s), 'subject': f's{s}', 'side': ('left', 'right')[t]}
          for s in range(6) for t in range(2)]
# Ellipsoids with a bump, each in a pose of its own; the two visits of s0 have a higher bump besides, which lies on the
# other side half a turn about the long axis off.
def bumpy(i):
    centres = [(0.8, 0.55, 0.24, 0.1), (-0.2, 0.55, -0.81, 0.125 * (i == 0)), (-0.2, -0.55, 0.81, 0.125 * (i == 1))]
    def turned(p, by):
        for k in range(3):
            c, s = math.cos(by + k), math.sin(by + k)
            p[k], p[k - 1] = c * p[k] - s * p[k - 1], s * p[k] + c * p[k - 1]
        return p
    def point(theta, phi):
        u = turned([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)], 1.3 * i)
        factor = 1 + sum(h * math.exp(7 * (x * u[0] + y * u[1] + z * u[2] - 1)) for x, y, z, h in centres)
        r = factor / math.sqrt((u[0] / 14) ** 2 + (u[1] / 9) ** 2 + (u[2] / 7) ** 2)
        return turned([r * x for x in u], 2.9 * i)
    xyz = [[point(math.pi * t / 30, 2 * math.pi * p / 60) for p in range(60)] for t in range(31)]
    grid = {'kind': 'equiangular', 'nTheta': 31, 'nPhi': 60, 'xyz': xyz}
    return send('/v1/surfaces', {'grid': grid, 'lmax': 12})['id']
bumps = [{'id': bumpy(i), 'subject': f's{i // 2}', 'time': i % 2} for i in range(10)]

# Each side measured twice; one kind has sides that differ in z, by another amount in each subject.
def measured(apart):
    return [{'id': surface(s, t + 2 * k, 1.5 + 0.2 * t, 1.0 + apart * t * math.cos(2.1 * s), t == 1), 'subject': f's{s}',
             'side': ('left', 'right')[t], 'covariates': {'replicate': k + 1}} for s in range(6) for t in range(2) for k in range(2)]
print(json.dumps({'bumps': bumps, 'same': surface(5, 0, 1.5, 1.0001), 'other': surface(5, 1, 1.5, 4.0), 'visits': visits, 'sides': sides, 'turned': turned, 'equal': measured(0.0), 'apart': measured(0.2)}))
PYTHON
cohort() { # NAME FILTER
    curl -sS -X DELETE "$URL/v1/cohorts/$1" -o "$SCRATCH/ignored"
    jq -c "{name: \"$1\", members: ($2)}" "$SCRATCH/members.json" >"$SCRATCH/cohort.json"
    post_json /v1/cohorts "@$SCRATCH/cohort.json"
}
run() { # PROCESS COHORT MORE
    execute "$1" "{\"cohort\":\"$2\",\"register\":false,\"permutations\":99,\"bootstraps\":200${3:-}}" --header "$WAIT"
}

# ---- Change -------------------------------------------------------------------------------------------

cohort study '[.visits[] | select(.time < 2)]'
is "$STATUS" 201 'a cohort with two visits'
run change study ',"fields":true'
is "$STATUS" 200 'has a change'
cp "$BODY" "$SCRATCH/change.json"
is "$(json '[.subjects, .permutations, .exact, .relabellings] | tojson')" '[6,31,true,32]' 'by all flips of six subjects'
compare "$(json '.pValue - 1/32 | fabs')" '<' 1e-12 'which is the least that they can give'
# z grows by .2 sqrt(3/(4 pi)) cos(theta): .0977 at the poles; about .05 as a root of the mean square.
compare "$(json '.largestEffect - 0.0977 | fabs')" '<' 0.02 'as large as planted'
is "$(json '[.change, .variation, .individual, .share | .value >= .interval[0] and .value <= .interval[1]] | all')" true \
    'within its interval'
compare "$(json '.change.interval[0] | real')" '>' 0.03 'which is off 0'
is "$(json '.distanceInterval[0] > 0 and .distanceInterval[0] < .distance and .distance < .distanceInterval[1]')" true \
    'as that of the distance'
is "$(json '[.perSubject[] | .subject, (.field | length)] | unique | length')" 7 'each subject has a field'
is "$(json '.surface.maps | length')" 8 'the mean has eight maps'
get "/v1/surfaces/$(json .surface.id)/mesh?format=ply"
is "$STATUS" 200 'which travel with its mesh'

cohort study .visits
run change study ',"from":1,"to":2'
is "$STATUS $(json '[.inputs.cohort.surfaces | length] | tojson')" '200 [12]' 'two of three visits'
compare "$(json .largestEffect)" '<' 0.05 'between which little happens'
run change study ',"from":1,"to":0'
compare "$(json .change.value)" '>' 0.03 'backwards'
compare "$(json '[.perSubject[].along | real] | min')" '>' 0 'all subjects go the same way'
run change study ',"from":0,"to":1,"scale":"shape"'
is "$(json '[.perSubject[] | (.sizes[0] / .sizes[1] - 1 | fabs) > 0.01] | all')" true 'sizes are told'
compare "$(json .change.value)" '<' "$(jq .change.value "$SCRATCH/change.json")" 'shape alone changes less'

# What a table looks like that is mistaken: every one is told by the names of subjects.
doubts() { # FILTER FROM TO PATTERN WHAT
    cohort doubtful ".visits | $1"
    run change doubtful ",\"from\":$2,\"to\":$3"
    like "$STATUS $(json '[.warnings[] | select(.code | test("^(slope|visits)-")) | "\(.code) \(.figures.subjects // .figures.members | join(","))"] | join(" | ")')" \
        "$4" "$5"
}
doubts . 0 1 '^200 $' 'a sound table has no warnings of its visits'
doubts . 1 2 '^200 $' 'nor where little happens'
doubts 'map(if .subject == "s2" then .time = 1 - .time else . end)' 0 1 '^200 slope-reversed s2$' 'visits in reversed order'
doubts '.[2].id as $a | .[5].id as $b | .[2].id = $b | .[5].id = $a' 1 2 '^200 .*visits-exchanged s0,s1$' \
    'visits exchanged between subjects'
doubts ".[16].id = \"$(jq -r .same "$SCRATCH/members.json")\"" 0 1 '^200 .*visits-coincide s5$' 'a surface that was saved twice'
doubts ".[16].id = \"$(jq -r .other "$SCRATCH/members.json")\"" 0 1 '^200 slope-odd s5$' 'a subject that is unlike all others'

cohort bumps .bumps
for process in change trajectories; do
    execute "$process" '{"cohort":"bumps","permutations":9,"bootstraps":100}' --header "$WAIT"
    is "$STATUS $(json '[.warnings[] | select(.code == "visits-apart") | .figures.subjects[]] | join(" ")')" '200 s0' \
        "$process tells of visits that lie on the mean otherwise than on each other"
done

refused() { # PROCESS COHORT-FILTER PATTERN MORE
    cohort wrong "$2"
    run "$1" wrong "${4:-}"
    like "$STATUS $(json '.errors[0] | "\(.pointer) \(.detail)"')" "$3" "refused by $1: $3"
}
refused change .visits '422 /inputs/cohort has more than two times, from 0 to 2: say by from and to'
refused change '[.visits[] | select(.time < 2)] | [.[:6], [range(0; 6)]] | transpose | map(.[0] + {time: (if .[0].time == 0 then 0 else 1 + .[1] / 10 end)})' \
    '422 /inputs/cohort has more than two times, from 0 to .*: no two subjects have the same two, .* Ask trajectories, where each subject has times of its own'
refused change .visits 'no pair, "s0" first, which has no member of time 7' ',"from":0,"to":7'
refused change '[.visits[] | select(.time < 1)]' 'has one time only, 0'
refused change .visits '422 /inputs/to and from are both 1; two different times' ',"from":1,"to":1'
refused change '[.visits[] | select(.time < 2)] | del(.[3])' '1 subject has no pair, "s1" first, which has no member of time 1'
refused change '[.visits[] | select(.time < 2)] | .[3].time = 0' 'subject "s1" has two members of time 0, 2 and 3'
refused change '[.visits[] | select(.time < 2)] | del(.[3].time)' 'member 3 .surf-.* has no time'
refused change '[.visits[] | select(.time < 2)] | del(.[3].subject)' 'member 3 .surf-.* has no subject'
refused change '[.visits[] | select(.time < 2)][:8]' 'has 4 pairs of time 0 and time 1; 5 are needed'
refused change .visits '/inputs/from must be a number' ',"from":"first"'

# ---- Asymmetry ----------------------------------------------------------------------------------------

cohort sides .sides
run asymmetry sides
is "$STATUS" 200 'a cohort with two sides'
cp "$BODY" "$SCRATCH/asymmetry.json"
compare "$(json '.pValue - 1/32 | fabs')" '<' 1e-12 'is asymmetric'
compare "$(json '.largestEffect - 0.0977 | fabs')" '<' 0.02 'as large as planted'
compare "$(json '.directional.value / .fluctuating.value')" '>' 2 'in one direction'
is "$(json '.distanceInterval[0] > 0 and .distanceInterval[0] < .distance and .distance < .distanceInterval[1]')" true \
    'whose distance is known within an interval'
is "$(json '[.inputs.cohort.mirrored | .[]] | map(tostring) | unique | join(" ")')" 'false true' 'the right ones are mirrored'
cohort sides '[.sides[] | .mirror = (.side == "right")]'
run asymmetry sides
is "$(json .pValue) $(json .directional.value)" \
    "$(jq -r '"\(.pValue) \(.directional.value)"' "$SCRATCH/asymmetry.json")" 'as if the cohort said so'
cohort sides '[.sides[] | .mirror = (.side == "left")]'
run asymmetry sides
compare "$(json ".directional.value / $(jq .directional.value "$SCRATCH/asymmetry.json") - 1 | fabs")" '<' 1e-6 \
    'or the left ones'

# Neither the order of the members nor which side is called the left one says anything of the surfaces. Signs turn, and
# no other figure changes by a bit; the mean of the other hand is the mirror image, with its maps and fields.
cat >"$SCRATCH/figures.py" <<'PYTHON'
import json, sys, urllib.request
url, exchanged, result = sys.argv[1], sys.argv[2] == 'exchanged', json.load(sys.stdin)
sign = -1.0 if exchanged else 1.0
names = ('pValue', 'leastSignificance', 'leastFdr', 'largestEffect', 'largestConfidence', 'distance', 'directional',
         'fluctuating', 'individual', 'share', 'relativeEnergy', 'iterations')

def image(field):  # phi to pi - phi
    columns = 2 * int((len(field) / 2) ** 0.5)
    return [sign * field[k - k % columns + (columns // 2 - k % columns) % columns] + 0.0 for k in range(len(field))]

for one in result['perSubject']:
    if exchanged:
        one['field'], one['sizes'] = image(one['field']), one['sizes'][::-1]
mean = json.load(urllib.request.urlopen(f'{url}/v1/surfaces/{result["surface"]["id"]}/coefficients'))
for axis in 'xyz':
    for l in range(mean['lmax'] + 1 if exchanged else 0):
        for m in range(-l, l + 1):
            sphere = -1 if (m > 0 and m % 2) or (m < 0 and m % 2 == 0) else 1
            mean[axis][l * l + l + m] *= sphere * (-1 if axis == 'x' else 1)
print(json.dumps([{name: result[name] for name in names}, result['perSubject'],
                  [[value + 0.0 for value in mean[axis]] for axis in 'xyz']], indent=1))
PYTHON
figures() { # FILE exchanged|same
    python3 "$SCRATCH/figures.py" "$URL" "$2" <"$BODY" >"$SCRATCH/$1"
}
# What is registered has the same bits too; sanitizers see it once.
for REGISTER in false true; do
    for SIDES in sides turned; do
        [ -n "$SRNFD_SANITIZED" ] && [ $SIDES = sides ] && continue
        INPUTS="{\"cohort\":\"sides\",\"register\":$REGISTER,\"permutations\":99,\"bootstraps\":200,\"fields\":true}"
        cohort sides ".$SIDES"
        execute asymmetry "$INPUTS" --header "$WAIT"
        is "$STATUS" 200 "$SIDES, register $REGISTER"
        figures given.json same
        [ -n "$SRNFD_SANITIZED" ] && [ $REGISTER = true ] && continue
        cohort sides ".$SIDES | reverse"
        execute asymmetry "$INPUTS" --header "$WAIT"
        figures reversed.json same
        is "$(diff "$SCRATCH/given.json" "$SCRATCH/reversed.json" | head -4)" '' 'in another order they are the same'
        cohort sides "[.${SIDES}[] | .side = if .side == \"left\" then \"right\" else \"left\" end]"
        execute asymmetry "$INPUTS" --header "$WAIT"
        figures exchanged.json exchanged
        is "$(diff "$SCRATCH/given.json" "$SCRATCH/exchanged.json" | head -4)" '' 'with sides exchanged their images'
    done
done

# Nuclei whose spheres lie anyhow: searches of their surfaces from the mean on end elsewhere. As they are, what lies
# between the sides is their distance, |t q - s p|^2 = s^2 + t^2 - 2 s t (1 - d^2 / 2).
if [ -z "$SRNFD_SANITIZED" ]; then
    MEMBERS=
    for NAME in thalamus pallidum amygdala putamen caudate hippocampus; do
        for SIDE in left right; do
            post /v1/meshes --data-binary "@tests/data/aal_subcortex/$([ $SIDE = left ] && echo L || echo R)_$NAME.ply"
            execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":8,\"parameterization\":\"area\"}"
            MIRROR=$([ $SIDE = left ] && echo false || echo true)
            MEMBERS="$MEMBERS${MEMBERS:+,}{\"id\":\"$(json .surface.id)\",\"subject\":\"$NAME\",\"side\":\"$SIDE\",\"mirror\":$MIRROR}"
        done
    done
    post_json /v1/cohorts "{\"name\":\"nuclei\",\"members\":[$MEMBERS]}"
    execute distances '{"cohort":"nuclei","register":false}' --header "$WAIT"
    cp "$BODY" "$SCRATCH/distances.json"
    run asymmetry nuclei
    is "$STATUS" 200 'nuclei, as they are'
    compare "$(jq --slurpfile apart "$SCRATCH/distances.json" '[$apart[0] as $all | .perSubject[] | . as $one | ($all.inputs.cohort.subjects | index($one.subject)) as $i |
        $all.matrix[$i][$i + 1] as $d | .sizes as [$s, $t] |
        ($s * $s + $t * $t - 2 * $s * $t * (1 - $d * $d / 2) | sqrt) / .distance - 1 | fabs] | max' "$BODY")" '<' 1e-9 \
        'are as far apart as their fields'
fi

cohort study '[.visits[] | select(.time < 2)]'
run change study ',"fields":true,"from":0,"to":1'
json '[.perSubject[].field[]] | tojson' >"$SCRATCH/forth.json"
run change study ',"fields":true,"from":1,"to":0'
is "$(json '[.perSubject[].field[] | 0 - .] | tojson')" "$(cat "$SCRATCH/forth.json")" 'visits exchanged turn signs alone'

refused asymmetry '[.sides[] | del(.side)]' '422 /inputs/cohort member 0 .surf-.* has no side'
refused asymmetry '.sides | del(.[0])' '1 subject has no pair, "s0" first, which has no member of the left side'
refused asymmetry '.sides | .[1].side = "left"' 'subject "s0" has two members of the left side, 0 and 1: take one of them, or number'

# ---- Measured repeatedly ------------------------------------------------------------------------------

cohort measured .equal
run asymmetry measured
is "$STATUS $(json '[.subjects, .replicates.measurements, .replicates.degreesOfFreedom] | tojson')" '200 [6,24,[5,12]]' \
    'sides that were measured twice'
compare "$(json .replicates.pValue)" '>' 0.05 'differ by no more than measurements do'
compare "$(json '.largestEffect - 0.0977 | fabs')" '<' 0.02 'but for what all have in common'
cohort measured .apart
run asymmetry measured
compare "$(json .replicates.pValue)" '<=' 0.01 'or by more'
is "$(json '.replicates | [.individual, .interaction, .error, .individualInterval, .interactionInterval, .errorInterval] |
    [.[:3], .[3:]] | transpose | map(.[1][0] < .[0] and .[0] < .[1][1]) | all')" true 'with the intervals of mean squares'
is "$(json '.replicates | [.f, .fluctuating, .measured, .repeatability] | map(.value >= .interval[0] and .value <= .interval[1]) | all')" \
    true 'within intervals'
compare "$(json '.replicates | .f.value - .interaction / .error | fabs')" '<' 1e-9 'by their mean squares'
json 'del(.replicates.relabellings) | [.replicates, .directional, .fluctuating, .perSubject] | tojson' >"$SCRATCH/measured.json"
TABLE=$(jq -r '.replicates | "individual by side</th><td>\(.interaction)</td><td>\(.interactionInterval | join(" "))</td>|\(.f.value)|\(.f.interval[0])|\(.f.interval[1])|\(.repeatability.value)"' "$BODY")
get '/v1/jobs?process=asymmetry'
execute report "{\"jobs\":[\"$(json '.jobs[0].id')\"],\"resolution\":8}"
REPORT=$(json .html)
six() { printf '%.6g' "$1"; }
IFS='|' read -r ROW F LOW HIGH SHARE <<<"$TABLE"
SQUARE=${ROW#*<td>} SQUARE=${SQUARE%%</td>*} ENDS=${ROW##*<td>} ENDS=${ENDS%%</td>*}
like "$REPORT" "individual by side</th><td>$(six "$SQUARE")</td><td>$(six "${ENDS% *}") to $(six "${ENDS#* }")</td><td>5</td>" 'a report has the analysis of variance'
like "$REPORT" "F, individual by side over error</th><td>$(six "$F")</td><td>$(six "$LOW") to $(six "$HIGH")</td>" 'with F and its interval'
like "$REPORT" "repeatability</th><td>$(six "$SHARE")</td>" 'and the repeatability, as the API says'
cohort measured '.apart | reverse'
run asymmetry measured
is "$(json '[.replicates, .directional, .fluctuating, .perSubject] | del(.[0].relabellings) | tojson')" \
    "$(cat "$SCRATCH/measured.json")" 'in any order'
cohort measured '.apart[1:]'
run asymmetry measured
is "$STATUS $(json .replicates.degreesOfFreedom[1])" '200 11' 'also where one was measured once'
is "$(json '.replicates.repeated') $(json '[.warnings[].code] | index("few-replicates")')" '6 null' 'of enough subjects'
cohort measured '[.apart[] | select(.covariates.replicate == 1 or .subject < "s4")]'
run asymmetry measured
is "$STATUS $(json '.replicates | [.repeated, .f.interval, .fluctuating.interval, .measured.interval, .repeatability.interval] | tojson')" \
    '200 [4,[null,null],[null,null],[null,null],[null,null]]' 'which four are not'
is "$(json '[.warnings[] | select(.code == "few-replicates") | .figures | [.subjects, .needed]] | tojson')" '[[4,5]]' 'and are told so'
cohort measured '[.sides[] | ., . + {covariates: {replicate: 2}} | .covariates.replicate //= 1]'
run asymmetry measured
is "$STATUS $(json '[.replicates, (.warnings | map(select(.code == "duplicate-content") | .detail | test("given twice")) | any)] | tojson')" \
    '200 [null,true]' 'the same file twice is no measurement, which is told beside the rest'
cohort sides .sides
run asymmetry sides
is "$(json 'has("replicates") and .replicates == null')" true 'one of each tells nothing of it'
refused asymmetry '.apart | .[1].covariates.replicate = 1' 'members 0 and 1 are the same replicate of the left side of subject "s0"'
# jq writes 1.0 as 1, and a cohort keeps which of the two it was given.
jq -c '{name: "wrong", members: .apart} | .members[1].covariates.replicate = "real"' "$SCRATCH/members.json" >"$SCRATCH/cohort.json"
curl -sS -X DELETE "$URL/v1/cohorts/wrong" -o "$SCRATCH/ignored"
post_json /v1/cohorts "$(sed 's/"real"/1.0/' "$SCRATCH/cohort.json")"
run asymmetry wrong
like "$STATUS $(json .detail)" '^422 .*members 0 and 1 are the same replicate' '1.0 is the replicate 1'
refused asymmetry 'del(.apart[1].covariates.replicate) | .apart' 'two members of the left side, 0 and 1: take one of them, or number'

stop_server || not_ok 'the server ends well'
done_testing
