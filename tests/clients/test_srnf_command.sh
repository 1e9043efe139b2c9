#!/usr/bin/env bash
# The command srnf as a new user has it: files of several formats, one broken; wrong labels; no server; no token; a quota;
# an interrupt in the middle. What it says, and its exit status.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

# As it is installed, with its bytecode: it starts some forty times.
cp -r "$ROOT/clients/python/src" "$SCRATCH/client"
/usr/bin/python3 -m compileall -q "$SCRATCH/client" || exit 1
export PYTHONPATH=$SCRATCH/client MPLBACKEND=Agg
NUCLEI=tests/data/aal_subcortex

# Runs srnf; RESULT is its exit status, OUT what it printed, SAID what it said on standard error.
srnf() {
    OUT=$(/usr/bin/python3 -B -m srnf "$@" </dev/null 2>"$SCRATCH/said")
    RESULT=$?
    SAID=$(cat "$SCRATCH/said")
}
out() { # JQ-FILTER
    jq -r "$1" <<<"$OUT" 2>/dev/null
}

start_server "$SCRATCH/data" || exit 1
export SRNF_SERVER=$URL

# ---- a folder of files of several formats ----------------------------------------------------------------

mkdir "$SCRATCH/brains"
for name in L_amygdala R_amygdala L_pallidum R_pallidum L_thalamus R_thalamus; do
    cp $NUCLEI/$name.ply "$SCRATCH/brains"
done
cd "$SCRATCH/brains" || exit 1
srnf upload R_amygdala.ply L_pallidum.ply R_pallidum.ply L_thalamus.ply R_thalamus.ply
is "$RESULT $(grep -c '^mesh-' <<<"$OUT")" '0 5' 'meshes are uploaded, an id a line'
read -r -a ids < <(awk '{ printf "%s ", $1 }' <<<"$OUT")
srnf fetch "${ids[0]}" R_amygdala.obj && rm R_amygdala.ply
srnf fetch "${ids[1]}" L_pallidum.stl && rm L_pallidum.ply
srnf fetch "${ids[2]}" R_pallidum.vtp && rm R_pallidum.ply
srnf fetch "${ids[3]}" L_thalamus.surf.gii && rm L_thalamus.ply
srnf fetch "${ids[4]}" R_thalamus.glb && rm R_thalamus.ply
is "$RESULT $(echo *)" '0 L_amygdala.ply L_pallidum.stl L_thalamus.surf.gii R_amygdala.obj R_pallidum.vtp R_thalamus.glb' \
    'fetch writes the format that the name says'
cd "$ROOT" || exit 1
table() {
    printf 'file,label,subject,side,age\n'
    printf '%s\n' L_amygdala,A,amygdala,left,41 R_amygdala,A,amygdala,right,41 L_pallidum,B,pallidum,left,50 \
        R_pallidum,B,pallidum,right,50 L_thalamus.surf.gii,B,thalamus,L,38 R_thalamus,B,thalamus,R,38
}
table >"$SCRATCH/labels.csv"
study() {
    srnf study "$SCRATCH/brains" --labels "$SCRATCH/labels.csv" --out "$SCRATCH/out" --lmax 4 --register none "$@"
}

table | sed '3s/.*/R_amygdola,A,amygdala,right,41/' >"$SCRATCH/labels.csv"
study
is "$RESULT" 3 'a wrong name in the table ends it'
like "$SAID" "labels.csv, line 3: there is no mesh 'R_amygdola' in .*; did you mean R_amygdala.obj\?" 'with the line, and what was meant'
is "$(ls -d "$SCRATCH/out" 2>/dev/null)" '' 'and nothing was done'
table | sed '3s/.*/R_amygdola,A,amygdala,right,41/' >"$SCRATCH/brains/labels.csv"
srnf study "$SCRATCH/brains" --out "$SCRATCH/out" --lmax 4
like "$RESULT $SAID" "^3 .*brains/labels.csv, line 3: there is no mesh 'R_amygdola'" 'the table of the folder itself is read'
table >"$SCRATCH/brains/labels.tsv"
srnf study "$SCRATCH/brains" --out "$SCRATCH/out" --lmax 4
like "$RESULT $SAID" '^3 .*labels.csv and labels.tsv: say which' 'and two of them are refused'
rm "$SCRATCH/brains"/labels.?sv
{ table && echo broken.ply,A,broken,left,9; } >"$SCRATCH/labels.csv"
head -c 3000 $NUCLEI/L_putamen.ply >"$SCRATCH/brains/broken.ply"
study
is "$RESULT" 3 'a broken file ends it'
like "$SAID" '1 of 7 files cannot be used:' 'it is counted'
like "$SAID" 'broken.ply: .*\(unparsable-mesh\)' 'and named, with the reason'
like "$SAID" '--skip-refused' 'and what to do'
study --json
is "$RESULT $(out '.exit, .problem.code, .problem.refused[0].file' | tr '\n' ' ')" '3 3 files-refused broken.ply ' 'in JSON, too'
study --skip-refused --json --steps encode,pca,groups,classify --no-figures
is "$RESULT $(out '[.members, (.refused | length), .report] | @json')" '7 [6,1,null]' 'without it the study is computed'
is "$(out '.steps | map(.name + " " + .status) | join(", ")')" 'encode done, pca done, groups failed, classify failed' \
    'and steps that three subjects do not allow fail by themselves, which the status says'
like "$(out '.steps[2].detail')" 'has 1 subject of label "A" and 2 of "B"; each group needs two' 'with the reason'
study --skip-refused --steps encode,distances,pca
is "$RESULT" 0 'what the members allow ends well'
like "$OUT" 'components [0-9]+ %' 'and says what came out'
is "$(sed 1d "$SCRATCH/out/tables/distances.csv" | wc -l)" 6 'tables are written'
study --skip-refused --steps distances --no-figures
like "$OUT" 'distances +[0-9.e-]+ \([LR]_[a-z]+, [LR]_[a-z]+\) to [0-9.]+ \(' 'distances alone say which members are nearest and farthest'
study --skip-refused --steps register --register none --no-figures
is "$RESULT" 3 'steps that the study does not have are no study'
like "$SAID" 'Nothing was computed.*register: each analysis registers' 'with the reason'
check 'figures' test -s "$SCRATCH/out/figures/distances.png"
check 'and the report' grep -q 'data:image/png;base64' "$SCRATCH/out/report.html"
is "$(grep -cE '(src|href)="?(http|//)' "$SCRATCH/out/report.html")" 0 'which needs no network'

# ---- what is at the server --------------------------------------------------------------------------------

srnf status
like "$OUT" 'srnfd [0-9.]+, ready' 'status says that the server is ready'
srnf status "$SCRATCH/out" --json
is "$RESULT $(out '.pca.status')" '0 successful' 'and how the jobs of a study are'
JOB=$(out .distances.jobID)
srnf fetch "$JOB" "$SCRATCH/distances.csv"
is "$RESULT $(wc -l <"$SCRATCH/distances.csv")" '0 7' 'the matrix of a job is fetched as CSV, with a head'
srnf fetch "$(jq -r .model.mean.id "$SCRATCH/out/results/pca.json")" "$SCRATCH/mean.glb"
is "$RESULT $(head -c 4 "$SCRATCH/mean.glb")" '0 glTF' 'a surface as GLB'
srnf fetch brains "$SCRATCH/brains.zip"
is "$RESULT $(head -c 2 "$SCRATCH/brains.zip")" '0 PK' 'a cohort as a zip'
srnf fetch surf-00000000000000000000000000000000
is "$RESULT" 1 'what does not exist is refused'
like "$SAID" '\(no-such-surface\)' 'by its code'
srnf run encode "mesh=@$NUCLEI/L_amygdala.ply" lmax=5
is "$RESULT $(out .surface.lmax)" '0 5' 'a process runs, with a file'
srnf run encode "mesh=@$NUCLEI/L_amygdala.ply" lmx=5
is "$RESULT" 3 'an input that does not exist is refused'
like "$SAID" "did you mean 'lmax'" 'with the one that was meant'
srnf processes register
like "$OUT" 'degree \(integer, 1\.\.32\) = 12' 'inputs are described'
srnf status --nonsense
is "$RESULT" 2 'a wrong option is a wrong command line'
for shell in bash zsh fish; do
    srnf completion $shell
    is "$RESULT $(grep -c 'skip-refused' <<<"$OUT")" '0 1' "$shell completes options"
done
srnf completion bash
is "$(eval "$OUT"; COMP_WORDS=(srnf study --register t) COMP_CWORD=3; _srnf; echo "${COMPREPLY[@]}")" template \
    'and bash the values of one'

# ---- an interrupt in the middle -----------------------------------------------------------------------------

misses() {
    get "/v1/jobs?limit=200"
    json '[.jobs[] | select(.cache == "miss" and .status == "successful") | .processID] | group_by(.) | map("\(.[0]) \(length)") | join(" ")'
}
BEFORE=$(misses)
slow=(study "$SCRATCH/brains" --labels "$SCRATCH/labels.csv" --skip-refused --out "$SCRATCH/slow" --lmax 12 --name slow
    --register template --degree 6 --steps "encode,register,pca" --no-figures)
env --default-signal=INT /usr/bin/python3 -B -m srnf "${slow[@]}" </dev/null >"$SCRATCH/slow.out" 2>"$SCRATCH/slow.err" &
PID=$!
SERVER_PIDS+=("$PID")
for _ in $(seq 400); do
    get "/v1/jobs?process=register"
    [ "$(json '.jobs | length')" -gt 0 ] && break
    sleep 0.05
done
kill -INT "$PID"
wait "$PID"
is "$?" 130 'an interrupt ends it with 130'
like "$(cat "$SCRATCH/slow.err")" 'Interrupted. What was queued goes on at the server' 'and says what becomes of the jobs'
unlike "$(cat "$SCRATCH/slow.err")" Traceback 'without a traceback'
srnf "${slow[@]}"
is "$RESULT" 0 'the same command goes on'
AFTER=$(misses)
is "$(sed 's/.*encode \([0-9]*\).*/\1/' <<<"$AFTER")" $(($(sed 's/.*encode \([0-9]*\).*/\1/' <<<"$BEFORE") + 1)) 'one job has encoded all six'
like "$AFTER" 'register 5$' 'and five registrations, none of them twice'

# ---- no server, no token, a quota -----------------------------------------------------------------------------

TOKEN=$("$SRNFD" token add --name ada --data "$SCRATCH/data")
echo "$TOKEN" >"$SCRATCH/token"
srnf status
is "$RESULT" 5 'without a token one is not admitted'
like "$SAID" '--token-file FILE, SRNF_TOKEN_FILE or SRNF_TOKEN' 'and told how to be'
srnf status --token-file "$SCRATCH/none"
is "$RESULT" 3 'a file that is not there'
like "$SAID" 'token file .*/none cannot be read: No such file' 'is named'
srnf --token-file "$SCRATCH/token" status
is "$RESULT" 0 'with one it works'
"$SRNFD" token add --name ada --role viewer --data "$SCRATCH/data" >"$SCRATCH/viewer"
SRNF_TOKEN_FILE=$SCRATCH/viewer srnf upload $NUCLEI/L_putamen.ply
is "$RESULT" 5 'a viewer may not upload'
"$SRNFD" token add --name eve --max-bytes 50000 --data "$SCRATCH/data" >"$SCRATCH/eve"
SRNF_TOKEN_FILE=$SCRATCH/eve srnf upload $NUCLEI/L_amygdala.ply $NUCLEI/R_pallidum.ply
is "$RESULT" 6 'a quota of bytes ends it'
like "$SAID" 'storage-quota-exceeded' 'by its name'

stop_server || not_ok 'the server ends well'
srnf status
is "$RESULT" 4 'without a server nothing works'
like "$SAID" 'Nothing answers at .*: connection refused. Is srnfd running there\?' 'and it says so'
srnf --server nowhere.invalid status
is "$RESULT" 4 'nor with a host that does not exist'
like "$SAID" "There is no host 'nowhere.invalid'" 'which is named'
done_testing
