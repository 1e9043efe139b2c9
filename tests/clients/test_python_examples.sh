#!/usr/bin/env bash
# The programs of clients/python/examples: twenty lines at most, and they run.
# srnfd-test: nightly
# srnfd-test: release-only
# srnfd-test: timeout 900
. "$(dirname "$0")/../support/lib.sh"

export PYTHONPATH=$ROOT/clients/python/src MPLBACKEND=Agg
unset SRNF_TOKEN SRNF_TOKEN_FILE
EXAMPLES=$ROOT/clients/python/examples
start_server "$SCRATCH/data" || exit 1
export SRNF_SERVER=$URL

program() { # NAME ARGUMENTS..
    local name=$1
    shift
    check "$name.py runs" /usr/bin/python3 -B "$EXAMPLES/$name.py" "$@"
    is "$(awk '/^(import|from) / { after = NR } { line[NR] = $0 } END { for (i = after + 1; i <= NR; i++) if (line[i] != "") n++
        print (n <= 20) }' "$EXAMPLES/$name.py")" 1 'and has twenty lines at most'
}
cd "$SCRATCH" || exit 1
mkdir nuclei hearts
ln -s "$ROOT"/tests/data/aal_subcortex/*.ply nuclei
PYTHONPATH=$ROOT/tests/clients:$PYTHONPATH /usr/bin/python3 -B -c 'import daemon; print(daemon.nuclei_table(), end="")' >nuclei.csv
/usr/bin/python3 -B "$ROOT/tests/clients/ventricles.py" hearts
program demo nuclei 10
program brain nuclei nuclei.csv 6
program cardiac hearts hearts/labels.csv 6
mv nuclei/R_putamen.ply new.ply && sed -i '/R_putamen/d' nuclei.csv
program new_subject nuclei nuclei.csv new.ply 6
for picture in demo-figures/geodesic nuclei-study/figures/groups-significance hearts-study/diastole/contraction \
    nuclei-study/new-subject; do
    is "$(head -c 4 $picture.png | tail -c 3)" PNG "$picture is drawn"
done
is "$(jq -c '.groups' hearts-study/diastole/results/groups.json)" '["dilated","healthy"]' 'the hearts are compared by their groups'
is "$(head -c 4 hearts-study/diastole/beat-0.glb)" glTF 'and one is seen to beat'

cd "$ROOT" || exit 1
stop_server || not_ok 'the server ends well'
done_testing
