#!/usr/bin/env bash
# srnfd-test: timeout 240
# srnfd-test: slow
# test_imports.sh - whole studies in one request: forms and archives, with the table of their members; what is refused,
# and that nothing of it is kept then.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 --max-body 4194304 || exit 1

# Tetrahedra, each with its own height, as OFF: 100 small meshes that are all different.
FILES=$SCRATCH/files
mkdir -p "$FILES"
printf 'file,label,subject,time,side,age,sex,"group, old"\r\n' >"$FILES/labels.csv"
for i in $(seq 100); do
    printf 'OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1.%03d\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' "$i" >"$FILES/s$i.off"
    printf 's%d.off,%s,%03d,%d,%s,%d.5,%s,"a ""%d"""\r\n' "$i" "$([ $((i % 2)) = 0 ] && echo case || echo control)" \
        $((i / 2)) $((i % 2)) "$([ $((i % 3)) = 0 ] && echo L || echo right)" $((20 + i % 50)) f "$i" >>"$FILES/labels.csv"
done
count_meshes() { sqlite3 "$SCRATCH/data/srnfd.db" 'SELECT count(*) FROM mesh'; }
staged() { find "$SCRATCH/data/blobs" -type f | wc -l; }
import() { # QUERY FILE
    post "/v1/imports$1" --data-binary "@$2" --header 'Content-Type: application/octet-stream'
}
refusals() { json '[.refused[] | "\(.file) \(.code)"] | sort | join("|")'; }

# ---- A form ------------------------------------------------------------------------------------------

forms=()
for i in $(seq 100); do
    forms+=(-F "file=@$FILES/s$i.off")
done
request POST '/v1/imports?cohort=hundred' "${forms[@]}" -F "file=@$FILES/labels.csv"
is "$STATUS $(json '"\(.meshes | length) \(.refusedCount) \(.cohort.name) \(.cohort.memberCount)"')" \
    '201 100 0 hundred 100' 'one request uploads a hundred meshes with their table'
is "$(json '.meshes[4] | "\(.file) \(.name) \(.format) \(.vertices) \(.new) \(.analysable)"')" \
    's5.off s5 off 4 true true' 'it tells of each'
get /v1/cohorts/hundred
is "$(json_in_order '.members[2] | [.label, .subject, .time, .side, .covariates] | tojson')" \
    '["control","001",1,"left",{"age":23.5,"group, old":"a \"3\"","sex":"f"}]' 'rows become members, in their order'
FIRST=$(json '.members[0].id')
post /v1/meshes --data-binary "@$FILES/s1.off"
is "$STATUS $(json .id)" "200 $FIRST" 'a mesh has the id that it has by itself'
request POST '/v1/imports?cohort=hundred' "${forms[@]}" -F "file=@$FILES/labels.csv"
is "$STATUS $(json '[.meshes[].new] | any')" '200 false' 'the same again changes nothing'
request POST /v1/imports -F cohort=named -F "mesh=@$FILES/s1.off;filename=sub/deep 1.off" -F "other=@$FILES/s2.off"
is "$STATUS $(json '"\(.cohort.name) \(.meshes[0].file) \(.meshes[0].name)"')" '201 named sub/deep 1.off s1' \
    'a field of the form names the cohort, too'
request POST /v1/imports -F colour=red -F "mesh=@$FILES/s1.off"
is_problem 422 invalid-input 'another field is refused'
request POST /v1/imports -F "table=@$FILES/labels.csv" "${forms[@]}"
is_problem 422 invalid-input 'a table without a cohort is refused'
post /v1/imports --data-binary $'--x\r\nContent-Disposition: form-data; name="f"; filename="a.off"\r\n\r\nOFF' \
    --header 'Content-Type: multipart/form-data; boundary=x'
is_problem 422 unparsable-archive 'a form that is cut off is refused'

# ---- Archives ----------------------------------------------------------------------------------------

before=$(count_meshes)
(cd "$FILES" && mkdir -p in && cp s1.off in/a.off && cp s2.off 'in/schräg.off' && printf 'x' >in/.DS_Store &&
    printf 'file;label;grösse\na.off;x;1,5\nschräg.off;y;2\n' >in/t.csv &&
    zip -q -r ../two.zip in && tar -cf ../two.tar in && tar -czf ../two.tar.gz in)
for form in zip tar tar.gz; do
    import "?cohort=by-$form" "$SCRATCH/two.$form"
    get "/v1/cohorts/by-$form"
    is "$STATUS $(json '[.members[] | [.label, .covariates["grösse"]]] | tojson')" '200 [["x",1.5],["y",2]]' \
        "a $form with a table of a spreadsheet is read, with names in UTF-8 and decimal commas"
done
printf 'file;Participant_ID\na.off;sub-01\nschräg.off;sub-01\n' >"$FILES/in/t.csv"
(cd "$FILES" && zip -q -r ../bids.zip in)
import '?cohort=bids' "$SCRATCH/bids.zip"
get /v1/cohorts/bids
is "$(json '[.members[] | [.subject, .covariates]] | tojson')" '[["sub-01",{}],["sub-01",{}]]' 'participants of BIDS are subjects'
printf 'file;participant_id;subject\na.off;sub-01;1\nschräg.off;sub-01;2\n' >"$FILES/in/t.csv"
(cd "$FILES" && zip -q -r ../both.zip in)
import '?cohort=both' "$SCRATCH/both.zip"
like "$STATUS $(json .detail)" '^422 .*participant_id and subject are both the subject' 'but not both'
import '' "$SCRATCH/two.zip"
is_problem 422 invalid-input 'whose table needs a cohort as well'
is "$(count_meshes)" "$before" 'all of which were there'

# ---- Volumes, warnings and figures -------------------------------------------------------------------

mkdir -p "$SCRATCH/mixed"
cp tests/data/aal_volume/subcortex.nii.gz "$SCRATCH/mixed/labels.nii.gz"
for i in 1 2 3; do
    printf 'OFF\n4 4 0\n0 0 0\n3 0 0\n0 1 0\n0 0 2.%03d\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' "$i" >"$SCRATCH/mixed/v$i.off"
done
printf 'file,group,age,dose\nv1.off,a,41,1\nv2.off,a,unknwon,2\nv3.off,b,43,NA\n' >"$SCRATCH/mixed/t.csv"
(cd "$SCRATCH/mixed" && zip -q ../mixed.zip ./*)
made_before=$(curl -fsS "$URL/metrics" | sed -n 's/^srnfd_meshes_total{source="made"} //p')
import '?cohort=mixed' "$SCRATCH/mixed.zip"
is "$STATUS $(json '[(.meshes | length), (.volumes | length), .cohort.memberCount] | tojson')" '201 [3,1,3]' \
    'a volume among the meshes is taken as a volume, and is no member'
VOLUME=$(json '.volumes[0].id')
is "$(json '.volumes[0] | [.file, .name, .new, .format] | tojson')" '["labels.nii.gz","labels",true,"nifti"]' 'told by itself'
is "$(json '.summary | [.meshes, .volumes, .new, .notAnalysable, .members] | tojson')" '[3,1,4,0,3]' 'with figures of what was taken'
is "$(json '[.summary.columns[] | .kind] | tojson')" '["text","text","text","number"]' 'and what its columns were read as'
is "$(json '[.warnings[].code] | tojson')" '["column-is-text","no-label-column"]' 'and warnings'
is "$(json '.warnings[0].figures | [.column, .line, .cell, .numbers] | tojson')" '["age",3,"unknwon",2]' 'that name the cell'
sed 's/^4 4 0$/4 3 0/; $d' "$SCRATCH/mixed/v1.off" >"$SCRATCH/mixed/hole.off"
printf 'file,label\nv2.off,a\nhole.off,b\n' >"$SCRATCH/mixed/t.csv"
post '/v1/imports?cohort=holed' -F "file=@$SCRATCH/mixed/t.csv" -F "file=@$SCRATCH/mixed/v2.off" -F "file=@$SCRATCH/mixed/hole.off"
is "$STATUS $(json '[.summary.notAnalysable, [.warnings[].code]] | tojson')" '201 [1,["not-analysable"]]' \
    'a mesh with a hole is warned of'
is "$(json '.warnings[0].figures | [.count, .files[0].file, .files[0].problem] | tojson')" '[1,"hole.off","mesh-not-closed"]' \
    'with its file and the code of its problem'
like "$(json '.warnings[0].detail')" '1 of the meshes .*: hole.off: 3 boundary edges' 'and why in words'
HOLED=$(json '.meshes[] | select(.file == "hole.off").id')
execute mean '{"cohort":"holed"}'
is_problem 422 mesh-not-closed 'a process that takes it is refused'
like "$(json .detail)" "^Member 1 \\($HOLED, \"hole\"\\) cannot be analysed: 3 boundary edges" 'by its member and name'
execute encode "{\"mesh\":\"$HOLED\"}"
like "$STATUS $(json .detail)" "^422 $HOLED, \"hole\", cannot be analysed: 3 boundary" 'or by its name alone'
strays() { # AGE.., of members of a table
    local i=0 age files=()
    printf 'file;label;age' >"$SCRATCH/mixed/t.csv"
    for age in "$@"; do
        i=$((i + 1))
        sed "s/2[.]00[0-9]/2.00$i/" "$SCRATCH/mixed/v1.off" >"$SCRATCH/mixed/w$i.off"
        printf '\nw%d.off;a;%s' "$i" "$age" >>"$SCRATCH/mixed/t.csv"
        files+=(-F "file=@$SCRATCH/mixed/w$i.off")
    done
    post /v1/imports -F "cohort=strays$(cksum <<<"$*" | cut -d " " -f 1)" -F "file=@$SCRATCH/mixed/t.csv" "${files[@]}"
    json '[.warnings[] | select(.code == "column-is-text") | .figures | [.column, .line, .cells, .numbers, .others]] | tojson'
}
is "$(strays 41 - 42 44 12,5y '?' 39)" '[["age",3,["-","12,5y","?"],4,3]]' \
    'several cells that are no numbers among more that are'
like "$(json '.warnings[0].detail')" '3 of its cells are no numbers: "-", "12,5y", "[?]", line 3 first' 'are quoted'
is "$(strays '41 y' '52 y' 60y)" '[["age",2,null,0,3]]' 'numbers that have their unit behind'
like "$(json '.warnings[0].detail')" 'the unit "y" stands behind its numbers: "41 y", "52 y", "60y"' 'are told of'
strays Mild 'mild ' severe severe severe severe severe severe severe severe >"$SCRATCH/strays.json"
is "$(json_in_order '.warnings[] | select(.code == "labels-alike") | .figures | tojson')" '{"of":"age","texts":["Mild","mild"]}' \
    'and texts that differ in case or white space alone'
printf 'file,label,subject\nw1.off,a,01\nw2.off,b,1\nw3.off,b,2\n' >"$SCRATCH/mixed/t.csv"
post /v1/imports -F cohort=spelt -F "file=@$SCRATCH/mixed/t.csv" -F "file=@$SCRATCH/mixed/w1.off" \
    -F "file=@$SCRATCH/mixed/w2.off" -F "file=@$SCRATCH/mixed/w3.off"
is "$(json_in_order '[.warnings[] | [.code, .figures]] | tojson')" '[["subjects-alike",{"texts":["01","1"],"count":1}]]' \
    'and subjects that differ so, or in zeros before a number'
is "$(strays 41 - - - - 43)" '[["age",3,["-"],2,4]]' 'so are many that stand for nothing'
is "$(strays 41 old young 43)" '[["age",3,["old","young"],2,2]]' 'so is a column of which half are numbers'
is "$(strays 0 left 0 right 0 up 0 down)" '[]' 'but not where they are the same number'
is "$(strays 41 old young old 43)" '[]' 'words with numbers among them are words'
is "$(strays 1.234,5 2.000,0 - 1.100,25)" '[["age",2,["1.234,5","2.000,0","-"],0,4]]' 'so are numbers whose thousands stand apart'
like "$(json '.warnings[0].detail')" 'its numbers are written as no number is read: "1.234,5"' 'in words of their own'
is "$(strays 950 $'1\xe2\x80\xaf200,5' $'1\xe2\x80\xaf100' 870)" "[[\"age\",3,[\"1"$'\xe2\x80\xaf'"200,5\",\"1"$'\xe2\x80\xaf'"100\"],2,2]]" 'or by the spaces of print'
is "$(strays 10% 10% '20 %')" '[["age",2,["10%","20 %"],0,3]]' 'so are percents'
is "$(strays $'\xe2\x88\x921,5' '<2' 1)" "[[\"age\",2,[\""$'\xe2\x88\x92'"1,5\",\"<2\"],1,2]]" 'a minus of print, and bounds'
is "$(strays 7.1.1 2021-03-01 40-50 6.0.0)" '[]' 'but not versions, dates and ranges'
get "/v1/volumes/$VOLUME"
is "$STATUS $(json .labelCount)" '200 12' 'the volume is there'
curl -fsS -o "$SCRATCH/back.nii.gz" "$URL/v1/volumes/$VOLUME/content"
check 'with the bytes that were sent' cmp "$SCRATCH/back.nii.gz" tests/data/aal_volume/subcortex.nii.gz
import '?cohort=mixed' "$SCRATCH/mixed.zip"
is "$STATUS $(json '[.volumes[0].new, .summary.new] | tojson')" '200 [false,0]' 'sent again it is the same volume'
post /v1/imports -F "file=@$SCRATCH/mixed/labels.nii.gz" -F "file=@tests/data/aal_volume/subcortex.seg.nrrd"
is "$STATUS $(json '[(.meshes | length), (.volumes | map(.format)), .warnings] | tojson')" '201 [0,["nifti","nrrd"],[]]' \
    'a form may bring volumes alone'
post /v1/imports -F cohort=only -F "file=@$SCRATCH/mixed/labels.nii.gz"
is_problem 422 unparsable-archive 'but no cohort of them'
printf 'file,label\nv1.off,a\nv2.off,a\nv3.off,b\nlabels.nii.gz,c\n' >"$SCRATCH/mixed/t.csv"
(cd "$SCRATCH/mixed" && zip -q ../row.zip ./*)
import '?cohort=row' "$SCRATCH/row.zip"
is "$STATUS $(json '.refused[0].code')" '422 invalid-row' 'a row about a volume is refused'
printf 'file,label,subject\nv1.off,"1,5",1e999\nv2.off,1.5,"2,5"\nv3.off,"1,5",x\n' >"$SCRATCH/mixed/t.csv"
(cd "$SCRATCH/mixed" && zip -q ../digits.zip v?.off t.csv)
import '?cohort=digits' "$SCRATCH/digits.zip"
is "$STATUS $(json '.warnings | tojson')" '201 []' 'labels and subjects are texts, whatever they look like'
get /v1/cohorts/digits
is "$(json '[.members[] | "\(.label) \(.subject)"] | tojson')" '["1,5 1e999","1.5 2,5","1,5 x"]' 'and are kept as they were written'
execute encode "{\"cohort\":\"mixed\",\"lmax\":4}" --header 'Prefer: wait=60'
is "$(curl -fsS "$URL/metrics" | sed -n 's/^srnfd_meshes_total{source="made"} //p')" "$made_before" \
    'and its meshes were prepared by the import'

# ---- What is refused ---------------------------------------------------------------------------------

# Each archive has one good mesh that is not there yet, and what is wrong.
fresh() { # NUMBER
    printf 'OFF\n4 4 0\n0 0 0\n2 0 0\n0 1 0\n0 0 1.%03d\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' "$1"
}
WRONG=$SCRATCH/wrong
refused() { # FILE "FILE CODE|FILE CODE" WHAT
    local before after
    before=$(count_meshes)
    import '?cohort=wrong' "$1"
    is "$STATUS $(json .code) $(refusals)" "422 import-refused $2" "refused with its reason: $3"
    after=$(count_meshes)
    get /v1/cohorts/wrong
    is "$STATUS $after" "404 $before" 'and nothing of it is kept'
}
made() { # NUMBER: an empty folder with a good mesh
    rm -rf "$WRONG"
    mkdir -p "$WRONG"
    fresh "$1" >"$WRONG/good.off"
}

made 1
echo 'no mesh' >"$WRONG/bad.off"
(cd "$WRONG" && zip -q ../bad.zip ./*.off)
refused "$SCRATCH/bad.zip" 'bad.off unparsable-mesh' 'a file that is no mesh'
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' >"$SCRATCH/index.obj"
post '/v1/meshes?format=obj' --data-binary "@$SCRATCH/index.obj"
is "$STATUS $(json .detail)" '422 face 0: index 9 is above the 3 vertices (as obj).' 'where it is wrong is said once'
printf '\xff\xfe1\0\t\0a\0\n\0' >"$SCRATCH/labels.txt"
post /v1/meshes --data-binary "@$SCRATCH/labels.txt"
like "$STATUS $(json .detail)" '^422 this is text in UTF-16.*save it in UTF-8' 'text of Windows is called by its name'
import '?cohort=part&partial=true' "$SCRATCH/bad.zip"
is "$STATUS $(json '"\(.meshes | length) \(.refused[0].file) \(.cohort.memberCount)"')" '201 1 bad.off 1' \
    'with partial=true the rest is kept'

# What goes with meshes and is none is passed over and named, unless a row is about it or it is the table.
made 41
mkdir "$WRONG/sub"
printf 'Made with care, by us.\nSee LICENSE.\n' | tee "$WRONG/README" "$WRONG/sub/notes.TXT" >"$WRONG/LICENSE.md"
: >"$WRONG/empty.txt"
(cd "$WRONG" && zip -q -r ../friends.zip .)
import '?cohort=friends' "$SCRATCH/friends.zip"
is "$STATUS $(json '[.cohort.memberCount, .refusedCount, [.warnings[].code]] | tojson')" '201 [1,0,["files-passed-over"]]' \
    'a text beside the meshes refuses nothing'
is "$(json '.warnings[0].figures | [.count, (.files | sort)] | tojson')" '[4,["LICENSE.md","README","empty.txt","sub/notes.TXT"]]' \
    'and each is named'
made 42
printf 'Made with care.\n' >"$WRONG/notes.txt"
printf 'file,label\ngood.off,a\nnotes.txt,b\n' >"$WRONG/t.csv"
(cd "$WRONG" && zip -q ../named.zip ./*)
refused "$SCRATCH/named.zip" 'notes.txt unparsable-mesh' 'a text that a row is about'
made 43
printf 'file\tlabel\ngood.off\ta\n' >"$WRONG/labels.txt"
(cd "$WRONG" && zip -q ../called.zip ./*)
refused "$SCRATCH/called.zip" 'labels.txt unparsable-mesh' 'a table that is called a text'
for kind in 'file;label' '"FILE" , label' $'\xef\xbb\xbffile,label' $'name,label\ngood,a'; do
    printf '%s\r\n' "$kind" >"$WRONG/labels.txt"
    (cd "$WRONG" && zip -q ../called.zip ./*)
    refused "$SCRATCH/called.zip" 'labels.txt unparsable-mesh' 'however it is written'
done
printf '\xff\xfef\0i\0l\0e\0\t\0a\0\n\0' >"$WRONG/labels.txt"
(cd "$WRONG" && zip -q ../called.zip ./*)
refused "$SCRATCH/called.zip" 'labels.txt unparsable-mesh' 'and in UTF-16'
made 44
echo 'no mesh' >"$WRONG/readme.off"
(cd "$WRONG" && zip -q ../mesh.zip ./*)
refused "$SCRATCH/mesh.zip" 'readme.off unparsable-mesh' 'what is called a mesh'

made 2
(cd "$WRONG" && cp good.off evil.off && tar --transform 's,evil,../../evil,' -cPf ../dots.tar good.off evil.off &&
    tar --transform 's,evil,/tmp/evil,' -cPf ../absolute.tar good.off evil.off &&
    ln -s /etc/passwd link.off && tar -cf ../link.tar good.off link.off && rm link.off &&
    ln good.off hard.off && tar -cf ../hard.tar good.off hard.off && rm hard.off &&
    ln -s good.off link.off && zip -q -y ../link.zip good.off link.off && rm link.off)
refused "$SCRATCH/dots.tar" '../../evil.off unsafe-path' 'a path that leads out'
refused "$SCRATCH/absolute.tar" '/tmp/evil.off unsafe-path' 'an absolute path'
refused "$SCRATCH/link.tar" 'link.off link' 'a symbolic link'
refused "$SCRATCH/hard.tar" 'hard.off link' 'a hard link'
refused "$SCRATCH/link.zip" 'link.off link' 'a symbolic link in a zip'
(cd "$WRONG" && zip -q -P secret ../locked.zip good.off evil.off)
refused "$SCRATCH/locked.zip" 'evil.off encrypted|good.off encrypted' 'an encrypted zip'
(cd "$WRONG" && tar --hard-dereference -cf ../twice.tar good.off good.off)
refused "$SCRATCH/twice.tar" 'good.off duplicate-file|good.off duplicate-file' 'two files of one name'
(cd "$WRONG" && zip -q ../inner.zip evil.off && cp ../inner.zip . && zip -q ../outer.zip good.off inner.zip)
refused "$SCRATCH/outer.zip" 'inner.zip nested-archive' 'an archive within an archive'
(cd "$WRONG" && cp good.off brain.nii.gz && zip -q ../volume.zip good.off brain.nii.gz)
refused "$SCRATCH/volume.zip" 'brain.nii.gz unparsable-volume' 'what is called a volume and is none'

table() { # TEXT: the good mesh, another one, and a table of this text
    rm -f "$SCRATCH/table.zip"
    printf '%b' "$1" >"$WRONG/t.csv"
    (cd "$WRONG" && zip -q ../table.zip good.off evil.off t.csv)
}
rm -f "$WRONG"/*.zip "$WRONG"/*.gz
table 'file,label\ngood.off,a\nabsent.off,b\n'
refused "$SCRATCH/table.zip" 'absent.off no-such-file|evil.off not-in-table' 'a row without its file, a file without its row'
for name in scans/good GOOD.stl 'C:\\\\scans\\\\good.off'; do
    table "file,label\\n$name,a\\nevil.off,b\\n"
    import '?cohort=wrong' "$SCRATCH/table.zip"
    like "$(json '.refused[] | select(.code == "no-such-file") | .detail')" 'did you mean good.off[?]$' "for $name the file is offered"
    like "$(json .detail)" 'did you mean good.off[?] Correct' 'also where the first refusal is quoted'
done
table 'file,label\ngood.off,a\nabsent.off,b\n'
DETAIL=$(import '?cohort=wrong' "$SCRATCH/table.zip"; json .detail)
like "$DETAIL" '^2 of what came were refused.* Correct them' 'the problem counts them'
table 'file,label\ngood.off,a\nevil.off,b\ngood.off,c\n'
refused "$SCRATCH/table.zip" 'good.off duplicate-row' 'two rows about one file'
table 'file,side\ngood.off,up\nevil.off,left\n'
refused "$SCRATCH/table.zip" 'good.off invalid-row' 'a side that is none'
import '?cohort=some&partial=true' "$SCRATCH/table.zip"
is "$STATUS $(json '"\([.meshes[].file] | join(" ")) \(.refused[0].code)"')" '201 evil.off invalid-row' \
    'with partial=true the other row is kept'
table 'file,subject,time\ngood.off,s,0\nevil.off,s,one year\n'
refused "$SCRATCH/table.zip" 'evil.off invalid-row' 'a time that is no number, and not the row whose time is one'
DETAIL=$(import '?cohort=wrong' "$SCRATCH/table.zip"; json .detail)
like "$DETAIL" 'line 3 of t.csv: time must be a number, in the unit of your choice, not "one year"' 'its cell is named'
import '?cohort=timed&partial=true' "$SCRATCH/table.zip"
is "$STATUS $(json '"\(.cohort.memberCount) \(.refusedCount)"')" '201 1 1' 'and with partial=true the other row is kept'
table 'file,time\ngood.off,one\nevil.off,1e999\n'
import '?cohort=wrong&partial=true' "$SCRATCH/table.zip"
is "$STATUS $(json .code) $(refusals)" '422 import-refused evil.off invalid-row|good.off invalid-row' 'no time is dropped in silence'
like "$(json .detail)" 'Correct them\.$' 'and what was asked for is not advised'
table 'file,mirror\ngood.off,true\nevil.off,yes\n'
refused "$SCRATCH/table.zip" 'evil.off invalid-row' 'a mirror that is neither true nor false'
DETAIL=$(import '?cohort=wrong' "$SCRATCH/table.zip"; json .detail)
like "$DETAIL" 'line 3 of t.csv: mirror must be true or false, or 1 or 0, not "yes"' 'is told what it may be'
table 'file,mirror\ngood.off,1\nevil.off,2\n'
refused "$SCRATCH/table.zip" 'evil.off invalid-row' 'so is another number'
table 'file,mirror\ngood.off,1\nevil.off,0\n'
import '?cohort=bits' "$SCRATCH/table.zip"
get /v1/cohorts/bits
is "$STATUS $(json '[.members[].mirror] | tojson')" '200 [true,false]' '1 and 0 are true and false'
table 'filename;Label;participant_id\ngood.off;a;s1\nevil.off;b;s2\n'
import '?cohort=wrong' "$SCRATCH/table.zip"
is "$STATUS $(json .detail)" '422 t.csv: it has no column "file"; its first line has "filename", "Label", "participant_id": rename "filename" if it is that one.' \
    'a table without its key names the columns that it has, and the one that may be meant'
table 'name,label\ngood.off,a\nevil.off,b\n'
import '?cohort=wrong' "$SCRATCH/table.zip"
is "$STATUS $(json .detail)" '422 t.csv: it has no column "file"; its first line has "name", "label".' 'or those alone'
table 'file,time,site\ngood.off,NA,\nevil.off,2,b\n'
import '?cohort=gaps' "$SCRATCH/table.zip"
is "$(json '[.summary.columns[] | [.name, .missing]] | tojson')" '[["file",0],["time",1],["site",1]]' \
    'cells that say nothing are counted'
table 'file,label\ngood.off,a\nabsent.off,b\nevil.off,b\n'
import '?cohort=counted&partial=true' "$SCRATCH/table.zip"
is "$STATUS $(json_in_order '.summary | [.members, .labels] | tojson')" '201 [2,{"a":1,"b":1}]' 'labels are counted of members'

printf 'solid' >"$WRONG/evil.off"
table 'file,label\ngood.off,a\nevil.off,b\n'
refused "$SCRATCH/table.zip" 'evil.off unparsable-mesh' 'a broken mesh that a row names, once'
DETAIL=$(import '?cohort=wrong' "$SCRATCH/table.zip"; json .detail)
like "$DETAIL" '^1 of what came was refused.*[^.]\. Correct it,' 'the problem is made of sentences'
made 2
cp "$WRONG/good.off" "$WRONG/evil.off"

wrong_table() { # TEXT WHAT
    table "$1"
    import '?cohort=wrong&partial=true' "$SCRATCH/table.zip"
    is_problem 422 invalid-input "a table is refused as a whole: $2"
}
wrong_table 'name,label\ngood.off,a\n' 'without a column for files'
wrong_table 'file,label\ngood.off,a,b\n' 'with a row of another length'
wrong_table 'file,label\n"good.off,a\n' 'with a quote that is not closed'
wrong_table 'file,age\ngood.off,"1,5"\nevil.off,"2,5"\n' 'with decimal commas between commas'
wrong_table 'file;age\ngood.off;1,5\nevil.off;2.5\n' 'with both decimal marks'
wrong_table 'file;age;mass\ngood.off;41,5;950\nevil.off;42;1.200\n' 'with what may be thousands beside decimal commas'
like "$(json .detail)" '"1[.]200" of column mass can be two numbers, since column age has "41,5"' 'which are named'
wrong_table 'file\tage\tmass\ngood.off\t41.5\t950\nevil.off\t42\t1,200\n' 'or beside decimal points'
table 'file;age;mass\ngood.off;41,5;0.125\nevil.off;42;1.5\n'
import '?cohort=marks&partial=true' "$SCRATCH/table.zip"
is "$STATUS $(json '[.summary.columns[] | .kind] | tojson')" '201 ["text","number","number"]' 'while 0.125 is no thousand'
wrong_table 'file,age\ngood.off,1\nevil.off,1e999\n' 'with a number that is too large'
like "$(json .detail)" 'line 3, column age: the number 1e999' 'with its line and column'
wrong_table 'file,age,Age\ngood.off,1,2\nevil.off,2,3\n' 'with two columns of one name'
wrong_table 'file,label\ngood.off,\xe4\n' 'in another encoding'

# ---- Bombs -------------------------------------------------------------------------------------------

whole() { # FILE STATUS CODE WHAT
    local before
    before=$(count_meshes)
    import '?cohort=wrong&partial=true' "$1"
    is_problem "$2" "$3" "$4"
    is "$(count_meshes)" "$before" 'and nothing of it is kept, partial or not'
}
made 3
(cd "$WRONG" && head -c 5000000 /dev/zero >big.off && zip -q ../big.zip good.off big.off)
whole "$SCRATCH/big.zip" 413 body-too-large 'a file that unpacks beyond the limit is refused'
(cd "$WRONG" && rm big.off && head -c 4000000 /dev/zero >z0.off && for i in $(seq 9); do cp z0.off "z$i.off"; done &&
    tar -czf ../many.tar.gz good.off z?.off)
whole "$SCRATCH/many.tar.gz" 413 body-too-large 'files that do so together are refused'

# What gzip packed within the entries counts as well: twenty volumes of 4 MB of nothing in 100 KB, and an STL likewise.
/usr/bin/python3 - "$SCRATCH" <<'PYTHON'
import gzip, io, struct, sys, zipfile
head = bytearray(352)
struct.pack_into('<i', head, 0, 348)
struct.pack_into('<8h', head, 40, 3, 160, 160, 160, 1, 1, 1, 1)
struct.pack_into('<hh', head, 70, 2, 8)
struct.pack_into('<8f', head, 76, 1, 1, 1, 1, 1, 1, 1, 1)
struct.pack_into('<f', head, 108, 352)
head[344:348] = b'n+1\0'
body = bytearray(head) + bytearray(160 ** 3)
body[352] = 1  # a label
volume = gzip.compress(bytes(body), 9)
solid = gzip.compress(b' ' * 80 + struct.pack('<I', 200000) + bytes(50 * 200000), 9)
for name, files in (('enough', [('v%02d.nii.gz', volume)] * 7), ('volumes', [('v%02d.nii.gz', volume)] * 20),
                    ('solids', [('s%02d.stl.gz', solid)] * 20)):
    with zipfile.ZipFile('%s/packed-%s.zip' % (sys.argv[1], name), 'w') as out:
        for i, (path, content) in enumerate(files):
            out.writestr(path % i, content)
PYTHON
request POST /v1/imports --data-binary "@$SCRATCH/packed-enough.zip"
is "$STATUS $(json '.volumes | length')" '201 7' 'volumes are unpacked as far as eight bodies go'
used() { # processor time of the daemon so far, hundredths of a second
    awk '{ print $14 + $15 }' "/proc/$SERVER_PID/stat"
}
for kind in volumes solids; do
    BEFORE=$(used)
    whole "$SCRATCH/packed-$kind.zip" 413 body-too-large "$kind that unpack to more are refused"
    like "$(json .detail)" '[0-9]\.(nii|stl)\.gz: .* 33554432 bytes .* several imports' '  by the file, and with the way out'
    note "$(wc -c <"$SCRATCH/packed-$kind.zip") bytes took $(($(used) - BEFORE)) hundredths of a second"
    [ -n "$SRNFD_SANITIZED" ] || compare $(($(used) - BEFORE)) '<' 300 '  in the time of those eight bodies'
done
head -c 300 "$SCRATCH/two.zip" >"$SCRATCH/cut.zip"
whole "$SCRATCH/cut.zip" 422 unparsable-archive 'a zip that is cut off is refused'
like "$(json .detail)" 'the zip ends early' 'which the problem says'
printf 'PK\5\6\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0' >"$SCRATCH/none.zip"
whole "$SCRATCH/none.zip" 422 unparsable-archive 'an empty zip is refused'
like "$(json .detail)" 'the zip is empty' 'as what it is'
head -c 250 "$SCRATCH/two.tar.gz" >"$SCRATCH/cut.tar.gz"
whole "$SCRATCH/cut.tar.gz" 422 unparsable-archive 'so is a tar.gz'
# A million entries without content, as local heads and a directory: in python, which writes them in seconds.
python3 - "$SCRATCH/million.zip" <<'PYTHON'
import struct, sys
with open(sys.argv[1], "wb") as out:
    heads, directory, at = [], [], 0
    for i in range(70000):
        name = b"%x" % i
        head = struct.pack("<IHHHHHIIIHH", 0x04034B50, 20, 0, 0, 0, 0, 0, 0, 0, len(name), 0)
        heads.append(head + name)
        at += len(head) + len(name)
    out.write(b"".join(heads))
PYTHON
# Nothing is unpacked where the directory of a zip says that it is too much, and no more than it says where that is less
# than there is: 900 files of 4 MB of zeros that say so, and the same that claim to have 1,000 bytes or none.
/usr/bin/python3 - "$SCRATCH" <<'PYTHON'
import struct, sys, zlib
deflate = zlib.compressobj(9, zlib.DEFLATED, -15)
size = 4000000
content = deflate.compress(bytes(size)) + deflate.flush()
def zip_of(count, claimed, flags=0):
    heads, directory, at = [], [], 0
    for i in range(count):
        name = b'z%05d.off' % i
        fields = (20, flags, 8, 0, 33, zlib.crc32(bytes(size)), len(content), claimed, len(name), 0)
        head = struct.pack('<IHHHHHIIIHH', 0x04034B50, *fields) + name + content
        directory.append(struct.pack('<IHHHHHHIIIHHHHHII', 0x02014B50, 20, *fields, 0, 0, 0, 0, at) + name)
        heads.append(head)
        at += len(head)
    directory = b''.join(directory)
    return b''.join(heads) + directory + struct.pack('<IHHHHIIH', 0x06054B50, 0, 0, count, count, len(directory), at, 0)
for name, arguments in (('honest', (900, size)), ('lying', (900, 1000)), ('silent', (900, 0, 8))):
    with open('%s/%s.zip' % (sys.argv[1], name), 'wb') as out:
        out.write(zip_of(*arguments))
PYTHON
BEFORE=$(used)
whole "$SCRATCH/honest.zip" 413 body-too-large 'a zip that says it unpacks to more is refused'
like "$(json .detail)" '^The body: .* 33554432 bytes .* several imports' '  with the way out'
compare $(($(used) - BEFORE)) '<=' "${SRNFD_SANITIZED:+1}8" '  before any of it is unpacked'
for kind in lying silent; do
    whole "$SCRATCH/$kind.zip" 422 unparsable-archive "and one that has more than it says ($kind)"
    like "$(json .detail)" 'more bytes than .*says' '  which is told'
done
(cd "$FILES" && zip -q - s1.off s2.off | cat >"$SCRATCH/streamed.zip")
import '?cohort=streamed' "$SCRATCH/streamed.zip"
is "$STATUS $(json '.meshes | length')" '201 2' 'what was packed into a pipe is read'
printf '7z\274\257\047\034 and more' >"$SCRATCH/x.7z"
whole "$SCRATCH/x.7z" 422 unparsable-archive 'a 7z is refused'
like "$(json .detail)" '7z' 'by its name'
: >"$SCRATCH/empty"
whole "$SCRATCH/empty" 422 unparsable-archive 'an empty body is refused'

is "$(staged)" 0 'no file is left on the disk'

# A million empty files, as heads and a directory.
perl -e 'my ($heads, $directory, $at) = ("", "", 0);
    for my $i (0 .. 999_999) {
        my $name = sprintf "%06d", $i;
        $heads .= pack("VvvvvvVVVvv", 0x04034b50, 20, 0, 0, 0, 0, 0, 0, 0, 6, 0) . $name;
        $directory .= pack("VvvvvvvVVVvvvvvVV", 0x02014b50, 20, 20, 0, 0, 0, 0, 0, 0, 0, 6, 0, 0, 0, 0, 0, $at) . $name;
        $at += 36;
    }
    print $heads, $directory, pack("VvvvvVVv", 0x06054b50, 0, 0, 65535, 65535, length $directory, length $heads, 0);' \
    >"$SCRATCH/million.zip"
stop_server "$SERVER_PID"
start_server "$SCRATCH/data" --workers 1 || exit 1
whole "$SCRATCH/million.zip" 413 body-too-large 'a zip of a million entries is refused'
like "$(json .detail)" '400000 entries' 'for their number'
if stop_server "$SERVER_PID"; then
    ok 'the server ends cleanly'
else
    not_ok 'the server ends cleanly'
fi
check 'the data are sound' "$SRNFD" check --data "$SCRATCH/data"
done_testing
