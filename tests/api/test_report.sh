#!/usr/bin/env bash
# test_report.sh - the process report end to end: one file whose numbers are those of the API, with its policy, small, and
# with every name escaped.
# srnfd-test: slow
# srnfd-test: no-asan (api/test_standard.sh reports on a cohort and five analyses of it)

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 2 || exit 1

HOSTILE='</script><img src=x onerror=hit=1>"'\''&amp;<!--'
MEMBERS=()
I=0
for name in L_thalamus L_putamen L_pallidum R_thalamus R_putamen R_pallidum; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MEMBERS+=("$(jq -nc --arg id "$(json .id)" --arg side "${name:0:1}" --arg subject "$I $HOSTILE" --argjson age $((40 + I * I)) \
        '{id: $id, label: $side, subject: $subject, covariates: {age: $age}}')")
    I=$((I + 1))
done
post_json /v1/cohorts "{\"name\":\"nuclei\",\"members\":[$(IFS=, && echo "${MEMBERS[*]}")]}"
is "$STATUS" 201 'a cohort whose subjects have hostile names'

analyse() { # PROCESS INPUTS: its results go to SCRATCH/PROCESS.json, its id to JOB
    execute "$1" "$2" --header 'Prefer: respond-async, wait=200'
    is "$STATUS" 200 "$1 ends"
    cp "$BODY" "$SCRATCH/$1.json"
    get "/v1/jobs?process=$1"
    JOB=$(json '.jobs[0].id')
}
analyse pca '{"cohort":"nuclei","lmax":4,"register":false}'
PCA=$JOB
analyse compare-groups '{"cohort":"nuclei","lmax":4,"register":false,"permutations":99}'
COMPARED=$JOB
analyse distances '{"cohort":"nuclei","lmax":4,"register":false}'
analyse regress '{"cohort":"nuclei","lmax":4,"register":false,"permutations":19,"bootstraps":100,"formula":"shape ~ age","at":[{"age":50}]}'
analyse classify '{"cohort":"nuclei","lmax":4,"method":["harmonic-nn"]}'

# ---- Of one job ----------------------------------------------------------------------------------------

execute report "$(jq -nc --arg job "$COMPARED" --arg title "A $HOSTILE" '{jobs: [$job], title: $title}')"
is "$STATUS" 200 'a report of a comparison'
is "$(json '.sections | map(.process) | join(" ")')" compare-groups 'says what it is of'
is "$(json .shapes)" 1 'it carries the mean with its maps'
like "$(json .html)" 'A &lt;/script&gt;&lt;img' 'under its title, as text'
REPORT=$(json '.inputs.jobs[0]')
is "$REPORT" "$COMPARED" 'and its inputs'
post_json "/v1/processes/report/execution" "{\"inputs\":{\"jobs\":[\"$COMPARED\"]}}" --header 'Prefer: respond-async'
is "$STATUS" 201 'in the background too'
ID=$(json .id)
get "/v1/jobs/$ID/results" # waits for nobody: the job may still run
for _ in $(seq 100); do
    [ "$STATUS" = 200 ] && break
    sleep 0.1
    get "/v1/jobs/$ID/results"
done
jq -j .html "$BODY" >"$SCRATCH/two.html"
get "/v1/jobs/$ID/results/html"
is "$STATUS $(header Content-Type)" '200 text/html; charset=utf-8' 'the file is had by itself'
like "$(header Content-Security-Policy)" '^sandbox allow-scripts' 'as a page of no origin'
unlike "$(header Content-Security-Policy)" 'same-origin' 'whatever is in it'
like "$(header Content-Security-Policy)" "default-src 'none'; img-src data: blob:;.* form-action 'none'" 'that asks no server'
check 'and is the same' cmp "$BODY" "$SCRATCH/two.html"
get "/v1/jobs/$ID/results/html" --header "If-None-Match: $(header ETag)"
is "$STATUS" 304 'which is asked for again by its tag'
get "/v1/jobs/$ID/results/bytes"
is "$STATUS $(header Content-Type)" '200 application/json' 'other outputs are JSON'

# ---- Of a cohort ---------------------------------------------------------------------------------------

execute report '{"cohort":"nuclei","modes":1,"resolution":16}'
is "$STATUS" 200 'a report of a cohort'
is "$(json '.sections | map(.process) | join(" ")')" 'distances pca compare-groups classify regress' 'has all analyses of it'
is "$(json '.shapes')" 10 'the mean, five along a component, two means, a coefficient and a prediction'
jq -j .html "$BODY" >"$SCRATCH/all.html"
compare "$(json .bytes)" '<' 5000000 'and is small'
is "$(json .bytes)" "$(wc -c <"$SCRATCH/all.html")" 'as it says'

python3 - "$SCRATCH" >"$SCRATCH/checks" 2>&1 <<'PYTHON'
import base64, hashlib, html.parser, json, re, struct, sys

folder = sys.argv[1]
page = open(f'{folder}/all.html', encoding='utf-8').read()
results = {name: json.load(open(f'{folder}/{name}.json')) for name in ('pca', 'compare-groups', 'distances', 'regress', 'classify')}


class Reader(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.tags, self.texts, self.scripts, self.styles, self.cells, self.inside, self.row = [], [], [], [], [], [], []
        self.attributes = []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, *one) for one in attrs]
        self.inside.append(tag)
        if tag == 'tr':
            self.row = []
        if tag in ('td', 'th'):
            self.row.append('')
        if tag == 'script':
            self.scripts.append([dict(attrs).get('type', ''), ''])
        if tag == 'style':
            self.styles.append('')
        if tag in ('meta', 'input', 'img', 'br', 'link'):
            self.inside.pop()

    def handle_endtag(self, tag):
        if tag == 'tr':
            self.cells.append(self.row)
        self.inside.pop()

    def handle_data(self, data):
        last = self.inside[-1] if self.inside else ''
        if last == 'script':
            self.scripts[-1][1] += data
        elif last == 'style':
            self.styles[-1] += data
        else:
            self.texts.append(data)
            if {'td', 'th'} & set(self.inside):
                self.row[-1] += data


def check(good, what, detail=''):
    print('ok' if good else 'not ok', what, detail, sep='\t')


reader = Reader()
reader.feed(page)
policy = next(value for tag, name, value in reader.attributes if tag == 'meta' and name == 'content' and value.startswith('default'))
digest = lambda text: "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'"
programs = [text for kind, text in reader.scripts if kind != 'application/json']
check(policy.startswith("default-src 'none'") and 'unsafe' not in policy and 'http' not in policy, 'the policy allows nothing from elsewhere', policy)
check(len(programs) == 1 and digest(programs[0]) in policy, 'one program, by its hash')
check(len(reader.styles) == 1 and digest(reader.styles[0]) in policy, 'one style, by its hash')
check(not {'img', 'iframe', 'link', 'object', 'base', 'form', 'svg'} & set(reader.tags), 'no element that a name has made', sorted(set(reader.tags)))
check(not [a for a in reader.attributes if a[1].startswith('on') or a[1] in ('style', 'src', 'href')], 'and no attribute')
subject = results['distances']['labels'][0]
check('<img src=x' in subject and any(subject in text for text in [''.join(row) for row in reader.cells]), 'names are text', subject)
data = json.loads(next(text for kind, text in reader.scripts if kind == 'application/json'))
sections = {one['process']: one['results'] for one in data['sections']}
check(sections['distances']['matrix'] == results['distances']['matrix'], 'distances are those of the API, to the last bit')
check(sections['pca']['model']['scores'] == results['pca']['model']['scores'], 'and so are scores')
check(sections['compare-groups']['pValue'] == results['compare-groups']['pValue'], 'and p')

six = lambda value: f'{value:.6g}'
has = lambda *row: list(row) in [one[:len(row)] for one in reader.cells]
floor = '≤ ' if results['compare-groups']['pValueIsFloor'] else ''
check(has('p', floor + six(results['compare-groups']['pValue'])) and has('distance', six(results['compare-groups']['distance'])),
      'p and the distance of the means are those of the API')
check(any(row and row[0] == '95 % interval of the distance' for row in reader.cells), 'with its interval')
check(has('1', six(results['pca']['model']['eigenvalues'][0]), six(results['pca']['model']['explained'][0])), 'eigenvalues too')
accuracy = results['classify']['methods']['harmonic-nn']['accuracy']
check(any(row[0] == 'harmonic-nn' and six(accuracy) in row for row in reader.cells if row), 'accuracies too')
method = results['classify']['methods']['harmonic-nn']
ends = lambda rate: f"{six(rate['interval'][0])} to {six(rate['interval'][1])}"
check(any(ends({'interval': method['confidenceInterval']}) in row and any(ends(method['balancedAccuracy']) in cell for cell in row) for row in reader.cells),
      'with their intervals, and that of the balanced accuracy', ends(method['balancedAccuracy']))
check(has('L', six(method['auc']['L']['value']), ends(method['auc']['L'])), 'areas under curves with theirs')
effect = results['regress']['coefficients'][1]['largestEffect']
check(has('name', 'degrees of freedom') and has('age', '1') and any('interval of r2' in row for row in reader.cells), 'rows are called by their names, first')
check('largestEffect' not in results['regress']['coefficients'][0] and any(six(effect) in row for row in reader.cells), 'and what the first row of a table lacks')
matrix = results['distances']['matrix']
check([row[1:] for row in reader.cells if row and row[0] == subject and len(row) == 7][0][1] == six(matrix[0][1]), 'distances too')

first = data['shapes'][0]
points = struct.unpack(f"<{3 * (10 * 16 * 16 + 2)}h", base64.b64decode(first['positions']))
faces = struct.unpack(f"<{3 * 20 * 16 * 16}H", base64.b64decode(data['lists'][0]['data']))
at = lambda v: [first['centre'][k] + first['radius'] * points[3 * v + k] / 32767 for k in range(3)]
volume = 0.0
for f in range(0, len(faces), 3):
    a, b, c = (at(v) for v in faces[f:f + 3])
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6
said = results['pca']['model']['mean']['volume']
check(abs(volume / said - 1) < 0.02, 'the mean that it carries has the volume of the mean', f'{volume} {said}')
maps = {name: one for shape in data['shapes'] for one in shape['maps'] for name in [one['name']]}
check({'significance', 'effect'} <= set(maps), 'the maps of the comparison are there', sorted(maps))
least = results['compare-groups']['leastSignificance']
compared = next(one['maps'] for one in data['shapes'] if {'significance', 'effect'} <= {m['name'] for m in one['maps']})
low = next(one['low'] for one in compared if one['name'] == 'significance')
check(abs(low - least) < 1e-6, 'whose least p is that of the API', f'{low} {least}')
text = ' '.join(reader.texts)
methods = text[text.rindex('Options and versions') - 6000:]
check('Freedman and Lane' in methods and 'All 20 different relabellings were taken' in methods and 'There were 99' not in methods, 'methods name the test and the permutations that were taken')
check('Shapes were not registered, but compared as they are parameterized.' in methods and 'registered elastically' not in methods and '[' not in methods, 'and say that nothing was registered')
check('There were 6 shapes (3 of label L, 3 of label R), of the cohort nuclei.' in methods, 'of how many shapes')
build = results['pca']['numericBuild']
check(any(row and row[0] == 'compare-groups' and 'permutations = 99' in row[3] for row in reader.cells) and [row[4] for row in reader.cells if len(row) == 5 and row[0] == 'pca'] in ([build], ['the same']) and text.count(build) == 1, 'what repeats the jobs is a table, with the build once')
PYTHON
[ -s "$SCRATCH/checks" ] || not_ok 'the report is read' 'nothing came'
while IFS=$'\t' read -r verdict name detail; do
    case $verdict in
    ok) ok "$name" ;;
    *) not_ok "$name" "$verdict $detail" ;;
    esac
done <"$SCRATCH/checks"

# ---- Lists that are seen as a whole -----------------------------------------------------------------------

# Two surfaces of each of five subjects: visits and structures at once, in two groups.
python3 - "$URL" >"$SCRATCH/twice.json" <<'PYTHON'
import json, math, sys, urllib.request

def surface(seed, z):
    rows = {axis: [0.0] * 25 for axis in 'xyz'}
    rows['x'][3], rows['y'][1], rows['z'][2] = 1.5, 1.2, z
    for axis in 'xyz':
        for k in range(4, 16):
            rows[axis][k] = 0.02 * math.sin(1.7 * seed * k + ord(axis) * k * k)
    request = urllib.request.Request(sys.argv[1] + '/v1/surfaces', json.dumps({'coefficients': {'lmax': 4, **rows}}).encode(),
                                     {'Content-Type': 'application/json'})
    return json.load(urllib.request.urlopen(request))['id']

print(json.dumps({'name': 'twice', 'members': [
    {'id': surface(s + visit / 9, 1 + 0.2 * visit), 'subject': f's{s} <img src=x>', 'time': visit, 'label': 'ab'[s % 2],
     'covariates': {'part': ('front', 'back')[visit]}} for s in range(6) for visit in (0, 1)]}))
PYTHON
post_json /v1/cohorts "@$SCRATCH/twice.json"
is "$STATUS" 201 'a cohort with visits and structures'
WHOLE=()
analyse trajectories '{"cohort":"twice","register":false,"permutations":19,"bootstraps":100,"formula":"shape ~ label","at":[{"time":0,"label":"a"},{"time":1,"label":"a"},{"time":0,"label":"b"},{"time":1,"label":"b"}]}'
WHOLE+=("\"$JOB\"")
analyse pca-parts '{"cohort":"twice","register":false,"modes":1,"relativePose":true}'
WHOLE+=("\"$JOB\"")
if [ -z "$SRNFD_SANITIZED" ]; then # they register all pairs, which test_neighbours.sh does with sanitizers
    post_json /v1/cohorts "$(jq -c '{name: "few", members: .members[:6]}' "$SCRATCH/twice.json")"
    analyse neighbours '{"cohort":"few","k":2}'
    WHOLE+=("\"$JOB\"")
    analyse register "$(jq -c '.members | {template: .[0].id, moving: .[2].id, commonPose: true}' "$SCRATCH/twice.json")"
    WHOLE+=("\"$JOB\"")
fi
execute report "{\"jobs\":[$(IFS=, && echo "${WHOLE[*]}")],\"title\":\"Whole\",\"resolution\":8}"
is "$STATUS" 200 'a report of slopes, structures and neighbours'
is "$(json .shapes)" "$([ -n "$SRNFD_SANITIZED" ] && echo 12 || echo 13)" 'the mean, a coefficient, four predictions, two means, four of a mode, and the registered one'
jq -j .html "$BODY" >"$SCRATCH/whole.html"
python3 - "$SCRATCH/whole.html" >"$SCRATCH/whole.data" <<'PYTHON'
import re, sys

print(re.search(r'<script type="application/json" id="data">(.*?)</script>', open(sys.argv[1], encoding='utf-8').read(), re.S).group(1))
PYTHON
is "$(jq -c '[.views[] | select(.kind == "rows") | [.section, .list, (.shapes | length)]]' "$SCRATCH/whole.data")" \
    '[[0,"predictions",4],[1,"parts",2],[1,"modes",4]]' 'each has one view of its list'
is "$(jq -c '[.views[] | select(.list == "predictions") | .shapes[]] == ([.views[] | select(.list == "predictions") | .shapes[]] | unique)' "$SCRATCH/whole.data")" \
    true 'with a shape of its own for each row'
is "$(jq -c '[.sections[0].results.predictions[].at]' "$SCRATCH/whole.data")" "$(jq -c '[.predictions[].at]' "$SCRATCH/trajectories.json")" 'whose points are those of the API'
if [ -z "$SRNFD_SANITIZED" ]; then
    is "$(jq -c '.sections[2].results.indices' "$SCRATCH/whole.data")" "$(jq -c .indices "$SCRATCH/neighbours.json")" 'neighbours too'
    NEAR=$(jq -r '(.labels[.indices[0][0]] | gsub("<"; "&lt;") | gsub(">"; "&gt;")) as $name | "\($name) ("' "$SCRATCH/neighbours.json")
    check 'and are named in a table' grep -qF "<td>$NEAR" "$SCRATCH/whole.html"
fi
unlike "$(cat "$SCRATCH/whole.html")" '<img' 'as text'
BETWEEN=$(jq -r '.betweenInterval[]' "$SCRATCH/trajectories.json" | xargs printf '%.6g ' | awk '{print $1 " to " $2}')
check 'variances of slopes have their interval' grep -qF "95 % interval of between</th><td>$BETWEEN</td>" "$SCRATCH/whole.html"
unlike "$(cat "$SCRATCH/whole.html" "$SCRATCH/all.html")" '<th[^>]*></th>' 'each column and row of a table has a name'
check 'places of structures by their names and axes' grep -qF \
    "<th scope=\"col\">x</th><th scope=\"col\">y</th><th scope=\"col\">z</th></tr></thead><tbody><tr><th scope=\"row\">front</th>" "$SCRATCH/whole.html"

# ---- Landmarks, and structures that classify --------------------------------------------------------------

analyse mean "$(jq -nc '{cohort: "nuclei", lmax: 4, maxIterations: 1, landmarks: {points: [range(6) | [10 + ., 200, 400]], heldOut: [2]}}')"
MEAN=$JOB
analyse classify-parts '{"cohort":"twice","lmax":4,"method":"srnf-nn","commonPose":true}'
execute report "{\"jobs\":[\"$MEAN\",\"$JOB\"],\"title\":\"Tables\",\"resolution\":8}"
is "$STATUS" 200 'a report of a mean with landmarks, and of structures that classify'
jq -j .html "$BODY" >"$SCRATCH/tables.html"
six() { # PROCESS FILTER: numbers of its results as a report writes them
    jq -r "$2" "$SCRATCH/$1.json" | xargs printf '%.6g\n' | paste -s -d '|' | sed 's/|/<\/td><td>/g'
}
row() { # TEXT: whether a row of a table of the report is this
    grep -qF -- "$1" "$SCRATCH/tables.html"
}
name_of() { # PROCESS FILTER: a name as text of a page
    jq -r "$2 | @html" "$SCRATCH/$1.json" | sed "s|&apos;|\&#39;|g"
}
check 'it has members with their labels and distances' \
    row "<td>$(name_of mean '.labels[0]')</td><td>$(name_of mean '.groups[0]')</td><td>$(six mean '.distances[0]')</td>"
check 'landmarks of members by their names, those that are met in words' \
    row "$(name_of mean '.labels[1]')</th><td>met</td><td>met</td><td>$(six mean '.landmarks.members[1].distances[2]')</td>"
check 'what is held out in a sentence' \
    row "Held out: 1: a root mean square of $(six mean .landmarks.heldOut.rmsDistance), at most $(six mean .landmarks.heldOut.maxDistance)."
check 'what each structure says alone' row "back, srnf-nn</th><td>$(six classify-parts '.parts[] | select(.name == "back") | .methods["srnf-nn"] | .accuracy, .correct')</td>"
check 'a matrix with the names of its rows' \
    row "<tr><th scope=\"row\">b</th><td>$(six classify-parts '.methods["srnf-nn"].confusion[1][]')</td></tr>"
check 'and of its columns' row 'taken for a</th><th scope="col">taken for b</th>'
unlike "$(cat "$SCRATCH/tables.html")" '<t[dh][^>]*>(seconds|bridged surfaces|p value is floor|mesh-[0-9a-f]{32})<' 'and nothing that only a program needs'

# ---- Of more shapes than it may carry -------------------------------------------------------------------

PATHS=() ENDS=()
for i in 0 3; do
    execute encode "{\"mesh\":$(jq .id <<<"${MEMBERS[i]}"),\"lmax\":4}"
    ENDS+=("$(json .surface.id)")
done
for steps in 11 12 13; do
    execute geodesic "{\"from\":\"${ENDS[0]}\",\"to\":\"${ENDS[1]}\",\"steps\":$steps,\"register\":false}"
    is "$STATUS" 200 "a path of $steps shapes"
    get '/v1/jobs?process=geodesic'
    PATHS+=("\"$(json '.jobs[0].id')\"")
done
execute report "{\"jobs\":[$(IFS=, && echo "${PATHS[*]}"),\"$PCA\",\"$COMPARED\"],\"modes\":10,\"resolution\":64,\"title\":\"Large\"}"
is "$STATUS $(json '.detail // (.warnings | map(.code) | join(" "))')" '200 shapes-omitted' 'a report without all shapes warns'
is "$(json '.warnings[0].figures | .shown + .omitted')" 60 'of those of three paths, of a model with five components, and of a mean'
is "$(json '.warnings[0].figures.shown')" "$(json .shapes)" 'as many as it carries'
compare "$(json '.warnings[0].figures.omitted')" '>' 1 'and as it lacks'
compare "$(json .bytes)" '<' 25000000 'it keeps its limit'
like "$(json .html)" '<section class="warning"><p>[0-9]+ shapes are not shown, as the shapes of a report have 16 MiB' 'and says so at its beginning'
like "$(json .html)" '(Further components|Another component): not shown' 'and where a component is missing'

# ---- What is refused -----------------------------------------------------------------------------------

execute report "{\"jobs\":[\"$ID\"]}"
is_problem 422 invalid-input 'a report of a report is refused'
like "$(json '.errors[0].detail')" 'is a report itself' 'by name'
execute report '{"cohort":"nobody"}'
is_problem 404 no-such-cohort 'so is a cohort that is not there'
EYE=$("$SRNFD" token add --data "$SCRATCH/data" --name ada 2>/dev/null)
post_json /v1/processes/report/execution "{\"inputs\":{\"jobs\":[\"$PCA\"]}}" --header "Authorization: Bearer $EYE"
is_problem 404 no-such-job "and a stranger's job"

stop_server
is $? 0 'the daemon ends well'
done_testing
