#!/usr/bin/env bash
# test_cohorts_edit.sh - cohorts that are changed, copied, filtered and paged, and that two change at once.
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1

IDS=()
for i in 1 2 3 4; do
    printf 'OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1.%d\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' "$i" >"$SCRATCH/$i.off"
    post "/v1/meshes?name=m$i" --data-binary "@$SCRATCH/$i.off"
    IDS+=("$(json .id)")
done
member() { # INDEX MORE
    printf '{"id":"%s"%s}' "${IDS[$1]}" "$2"
}
post_json /v1/cohorts "{\"name\":\"study\",\"members\":[$(member 0 ',"label":"a","subject":"s1","time":1,"side":"left","covariates":{"age":40,"sex":"f"}'),$(member 1 ',"label":"b","subject":"s1","time":2.5,"side":"right","covariates":{"age":50}'),$(member 2 ',"label":"a"')]}"
is "$STATUS $(json '.members | map([.time, .side]) | tojson')" '201 [[1,"left"],[2.5,"right"],[null,null]]' \
    'members have a time and a side'
get /v1/cohorts/study
TAG=$(header ETag)
patch() { # JSON [CURL ARGUMENTS..]
    local document=$1
    shift
    request PATCH /v1/cohorts/study --header 'Content-Type: application/json' --data-binary "$document" "$@"
}

# ---- PATCH -------------------------------------------------------------------------------------------

patch "{\"change\":[{\"id\":\"${IDS[0]}\",\"label\":\"c\",\"side\":null,\"covariates\":{\"age\":41,\"sex\":null}}]}"
is "$STATUS $(json '.members[0] | [.label, .subject, .time, .side, .covariates] | tojson')" \
    '200 ["c","s1",1,null,{"age":41}]' 'what is said of a member is changed, and taken away by null'
isnt "$(header ETag)" "$TAG" 'which gives the cohort another tag'
NEXT=$(header ETag)
patch "{\"remove\":[\"${IDS[1]}\"]}" --header "If-Match: $TAG"
is_problem 412 precondition-failed 'who has not seen that cannot change it'
patch "{\"remove\":[\"${IDS[1]}\"],\"add\":[$(member 3 '')]}" --header "If-Match: $NEXT"
is "$STATUS $(json '.members | map(.id) | join(" ")')" "200 ${IDS[0]} ${IDS[2]} ${IDS[3]}" \
    'who has can remove and add members'
patch "{\"remove\":[\"${IDS[1]}\"]}"
is_problem 422 invalid-input 'a member that is not there cannot be removed'
is "$(json '.errors[0].pointer')" /remove/0 'which is named by its place'
patch "{\"change\":[{\"id\":\"${IDS[0]}\"},{\"id\":\"${IDS[1]}\"},{\"id\":\"${IDS[2]}\",\"covariates\":5}]}"
is "$STATUS $(json '[.errors[].pointer] | sort | join(" ")')" '422 /change/1 /change/2/covariates' 'as are changes'
patch "{\"remove\":[\"${IDS[0]}\",\"${IDS[2]}\",\"${IDS[3]}\"]}"
is_problem 422 invalid-input 'and one must be left'
patch "{\"change\":[{\"id\":\"${IDS[0]}\",\"side\":\"up\"}]}"
is_problem 422 invalid-input 'a side that is none is refused'
patch '{"add":[{"id":"mesh-00000000000000000000000000000000"}]}'
is_problem 422 invalid-input 'and a member that does not exist'
patch '{"more":1}'
is_problem 422 invalid-input 'and an unknown member of the body'
get /v1/cohorts/study
is "$(json .memberCount)" 3 'none of which changed anything'
post_json /v1/cohorts "{\"name\":\"taken\",\"members\":[$(member 0 '')]}"
patch '{"name":"taken"}'
is_problem 409 cohort-exists 'a name that is taken is refused'
patch '{"name":"renamed"}'
is "$STATUS $(json .name)" '200 renamed' 'a cohort is renamed'
get /v1/cohorts/study
is_problem 404 no-such-cohort 'and its old name is free'
request PATCH /v1/cohorts/study --header 'Content-Type: application/json' --data-binary '{"name":"x"}'
is_problem 404 no-such-cohort 'what is not there cannot be changed'

# Eight at once add a label each: none undoes another's.
post_json /v1/cohorts "{\"name\":\"busy\",\"members\":[$(member 0 '')]}"
pids=()
for i in 1 2 3 4; do
    curl -fsS -X PATCH "$URL/v1/cohorts/busy" -H 'Content-Type: application/json' -o /dev/null \
        -d "{\"change\":[{\"id\":\"${IDS[0]}\",\"covariates\":{\"c$i\":$i}}]}" &
    pids+=("$!")
done
wait "${pids[@]}"
get /v1/cohorts/busy
is "$(json '.members[0].covariates | tojson')" '{"c1":1,"c2":2,"c3":3,"c4":4}' 'changes at once are all made'

# ---- PUT and CSV -------------------------------------------------------------------------------------

get '/v1/cohorts/renamed/members?format=csv'
is "$STATUS $(tr -d '\r' <"$BODY" | head -n 2 | paste -sd '|')" \
    "200 id,label,subject,time,side,mirror,age|${IDS[0]},c,s1,1,,false,41" 'members come as CSV'
sed "s/,c,s1,1,,/,\"d, e\",s1,1,L,/" "$BODY" >"$SCRATCH/members.csv"
request PUT /v1/cohorts/renamed/members --header 'Content-Type: text/csv' --data-binary "@$SCRATCH/members.csv"
is "$STATUS $(json '.members[0] | [.label, .side, .covariates] | tojson')" '200 ["d, e","left",{"age":41}]' \
    'and go back as CSV'
TAG=$(header ETag)
is "$(json '.warnings | tojson')" '[]' 'without a warning'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: text/csv' \
    --data-binary "$(printf 'id,lable,subject\n%s,a,s1\n' "${IDS[0]}")"
is "$STATUS $(json '[.members[0].label, (.warnings | map([.code, .figures.column]))] | tojson')" \
    '200 [null,[["no-label-column","lable"]]]' 'a table without labels is warned of, as in an import'
like "$(json '.warnings[0].detail')" 'did you mean "lable" to be it[?]' 'with the column that is likely the one'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: text/csv' --data-binary "$(
    printf 'id,label,age\n%s,a,40\n%s,b,x\n%s,b,50\n' "${IDS[@]:0:3}"
)"
is "$STATUS $(json '[.warnings[].code] | tojson')" '200 ["column-is-text"]' 'and so is a column that is text by mistake'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: text/csv' --data-binary "@$SCRATCH/members.csv"
TAG=$(header ETag)
post_json /v1/cohorts "{\"name\":\"twice\",\"members\":[{\"id\":\"${IDS[0]}\",\"label\":\"real\",\"covariates\":{\"Label\":\"other\",\"\":1,\"participant_id\":\"p1\"}}]}"
get '/v1/cohorts/twice/members?format=csv'
is "$(tr -d '\r' <"$BODY" | paste -sd '|')" \
    "id,label,subject,time,side,mirror,covariate ,covariate Label,covariate participant_id|${IDS[0]},real,,,,false,1,other,p1" \
    'a covariate that is called as a column is told apart from it'
cp "$BODY" "$SCRATCH/twice.csv"
request PUT /v1/cohorts/twice/members --header 'Content-Type: text/csv' --data-binary "@$SCRATCH/twice.csv"
is "$STATUS $(json '.members[0].label')" '200 real' 'so that it goes back'
request PUT /v1/cohorts/twice/members --header 'Content-Type: text/csv' \
    --data-binary "$(printf 'id,age,third,tiny\n%s,49.2,%s,%s\n' "${IDS[0]}" 0.33333333333333331 -1.1e-300)"
get '/v1/cohorts/twice/members?format=csv'
is "$(tr -d '\r' <"$BODY" | tail -n 1)" "${IDS[0]},,,,,false,49.2,0.3333333333333333,-1.1e-300" 'numbers come as short as they can be'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: text/csv' --data-binary $'label,surface_id,participant_id\nnone,x,y\n'
like "$STATUS $(json .detail)" '422 .* no column "id"; its first line has "label", "surface_id", "participant_id": rename "surface_id" if it is that one' \
    'a table without ids names its columns'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: text/csv' --data-binary $'id,label\nnone,x\n'
is_problem 422 invalid-input 'a row without an id is refused'
like "$(json '.errors[0].detail')" 'line 2' 'with its line'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: application/json' \
    --data-binary "{\"members\":[$(member 2 ''),$(member 1 '')]}" --header "If-Match: $TAG"
is "$STATUS $(json '.members | map(.id) | join(" ")')" "200 ${IDS[2]} ${IDS[1]}" 'or as JSON'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: application/json' \
    --data-binary "{\"members\":[$(member 2 '')]}" --header "If-Match: $TAG"
is_problem 412 precondition-failed 'with a tag, once'
request PUT /v1/cohorts/renamed/members --header 'Content-Type: text/plain' --data-binary x
is_problem 415 unsupported-media-type 'and as nothing else'

# ---- Copies ------------------------------------------------------------------------------------------

post_json /v1/cohorts "{\"name\":\"all\",\"members\":[$(member 0 ',"label":"a","covariates":{"age":40,"sex":"f"}'),$(member 1 ',"label":"b","covariates":{"age":50}'),$(member 2 ',"label":"a","covariates":{"age":60}'),$(member 3 ',"label":"c"')]}"
copied() { # WHERE
    post_json /v1/cohorts "{\"name\":\"copy\",\"from\":\"all\"$1}"
    printf '%s %s' "$STATUS" "$(json '[.members[].label] | join("")')"
    request DELETE /v1/cohorts/copy >/dev/null
}
is "$(copied '')" '201 abac' 'a cohort is copied'
is "$(copied ',"where":{"label":"a"}')" '201 aa' 'by a label'
is "$(copied ',"where":{"label":["b","c"]}')" '201 bc' 'by one of several'
is "$(copied ',"where":{"covariates":{"age":{"min":50}}}')" '201 ba' 'from a number on'
is "$(copied ',"where":{"label":"a","covariates":{"age":{"max":50},"sex":"f"}}')" '201 a' 'by all of several'
is "$(copied ',"where":{"covariates":{"age":null}}')" '201 c' 'or by what is not said'
post_json /v1/cohorts '{"name":"copy","from":"all","where":{"label":"z"}}'
is_problem 422 invalid-input 'where no member is like that there is no copy'
post_json /v1/cohorts '{"name":"copy","from":"all","where":{"age":3}}'
is_problem 422 invalid-input 'and a covariate stands among the covariates'
where_refused() { # WHERE POINTER WORDS WHAT
    post_json /v1/cohorts "{\"name\":\"copy\",\"from\":\"all\",\"where\":$1}"
    is "$STATUS $(json '"\(.code) \(.errors[0].pointer)"')" "422 invalid-input /where/$2" "refused: $4"
    like "$(json '.errors[0].detail')" "$3" 'which the problem says'
}
where_refused '{"covariates":{"age":{"min":"40"}}}' covariates/age/min 'must be a number' 'a bound that is a text'
where_refused '{"covariates":{"age":{"mim":40}}}' covariates/age/mim '"min" and "max"' 'an unknown bound'
where_refused '{"covariates":{"age":{}}}' covariates/age 'empty range' 'an empty range'
where_refused '{"covariates":{"age":[40,{"max":null}]}}' covariates/age/1/max 'must be a number' 'a wrong range in an array'
where_refused '{"covariates":{"agee":null}}' covariates/agee '"agee"; there are "age", "sex"' 'a covariate that no member has'
where_refused '{"covariates":[]}' covariates 'an object' 'covariates without names'
where_refused '{"side":"links"}' side '"left", "right" or null' 'a side that is none'
where_refused '{"time":{"min":"1"}}' time/min 'must be a number' 'a time that is a text'
where_refused '{"label":{"min":1}}' label 'a text or null' 'a range of labels'
post_json /v1/cohorts '{"name":"copy","from":"none"}'
is_problem 404 no-such-cohort 'nor is there one of a cohort that is not there'

get '/v1/cohorts/all/members?side=links'
is_problem 422 invalid-input 'members of a side that is none are not listed'
like "$(json .detail)" 'left or right, or empty' 'and the problem says which there are'
get '/v1/cohorts/all/members?side='
is "$STATUS $(json '.items | length')" '200 4' 'those without a side are'
request PUT /v1/cohorts/all/members --header 'Content-Type: text/csv' --data-binary "id,age
${IDS[0]},40
${IDS[1]},-1e999"
is_problem 422 invalid-input 'a number that is too large is refused'
like "$(json .detail)" 'line 3, column age: the number -1e999' 'with its line and column'

# ---- Many --------------------------------------------------------------------------------------------

many() { # COUNT
    printf '{"name":"many","members":['
    awk -v n="$1" -v id="${IDS[0]}" 'BEGIN { for (i = 0; i < n; i++) printf "%s{\"id\":\"%s\",\"subject\":\"%d\",\"covariates\":{\"n\":%d}}", i ? "," : "", id, i, i }'
    printf ']}'
}
COUNT=100000
[ -n "$SRNFD_SANITIZED" ] && COUNT=12000
many "$COUNT" >"$SCRATCH/many.json"
began=$(date +%s%3N)
post /v1/cohorts --header 'Content-Type: application/json' --data-binary "@$SCRATCH/many.json"
note "a cohort of $COUNT took $(($(date +%s%3N) - began)) ms"
is "$STATUS $(json '"\(.memberCount) \(has("members")) \(.links.members)"')" "201 $COUNT false /v1/cohorts/many/members" \
    'a cohort has up to 100,000 members, and says where they are'
began=$(date +%s%3N)
get "/v1/cohorts/many/members?limit=10000"
note "a page of it took $(($(date +%s%3N) - began)) ms"
is "$STATUS $(json '"\(.items | length) \(.items[9999].subject) \(.total)"')" "200 10000 9999 $COUNT" 'they come in pages'
CURSOR=$(json .next)
get "/v1/cohorts/many/members?limit=1&cursor=$CURSOR"
is "$(json '.items[0].subject')" 10000 'one after another'
get "/v1/cohorts/many/members?subject=777"
is "$(json '[.items[].covariates.n, .next] | tojson')" '[777,null]' 'or those of a subject'
request PATCH /v1/cohorts/many --header 'Content-Type: application/json' --data-binary '{"name":"many.2"}'
get "/v1/cohorts/many.2/members?limit=1&cursor=$CURSOR"
is "$STATUS" 200 'a cursor holds for the same members'
request PATCH /v1/cohorts/many.2 --header 'Content-Type: application/json' \
    --data-binary "{\"add\":[$(member 1 '')]}"
if [ "$COUNT" = 100000 ]; then
    is_problem 422 invalid-input 'one more is too many'
fi
request PATCH /v1/cohorts/many.2 --header 'Content-Type: application/json' \
    --data-binary "{\"change\":[{\"id\":\"${IDS[0]}\",\"label\":\"x\"}]}"
is "$STATUS" 200 'all are changed'
get "/v1/cohorts/many.2/members?limit=1&cursor=$CURSOR"
is_problem 412 precondition-failed 'and after a change a cursor begins again'
execute mean '{"cohort":"many.2"}'
is_problem 422 invalid-input 'a group that is computed has fewer'
like "$(json .detail)" 'to 10000' 'which the problem says'

if stop_server "$SERVER_PID"; then
    ok 'the server ends cleanly'
else
    not_ok 'the server ends cleanly'
fi
check 'the data are sound' "$SRNFD" check --data "$SCRATCH/data"
done_testing
