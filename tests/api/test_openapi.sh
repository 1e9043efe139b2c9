#!/usr/bin/env bash
# api/openapi.yaml against the daemon, both ways: its routes with their query parameters against the table that
# `srnfd routes` prints, and the schemas of the processes against what the tables give (make openapi) and
# GET /v1/processes/{id} answers. The file is
# read line by line: its layout (two spaces a level, parameters by reference, process schemas as JSON) is part of
# what is checked, since another layout finds no routes at all.
# srnfd-test: slow
# srnfd-test: no-asan (api/test_standard.sh runs its code)
. "$(dirname "$0")/../support/lib.sh"

OPENAPI=api/openapi.yaml

# "METHOD path a,b": the operations of the file with their query parameters, sorted.
described_routes() {
    awk '
        /^components:/ { part = "components" }
        /^paths:/ { part = "paths" }
        part == "components" && /^  [a-z]/ { section = $1 }
        part == "components" && section == "parameters:" && /^    [A-Za-z]+:$/ { key = substr($1, 1, length($1) - 1) }
        part == "components" && section == "parameters:" && /^      name: / { name[key] = $2 }
        part == "components" && section == "parameters:" && /^      in: query$/ { query[key] = 1 }
        part == "paths" && /^  \// { path = $1; sub(/:$/, "", path) }
        part == "paths" && /^    (get|post|put|patch|delete):$/ {
            n++
            op[n] = toupper(substr($1, 1, length($1) - 1)) " " path
        }
        part == "paths" && /#\/components\/parameters\// {
            split($0, piece, "/")
            sub(/\x27.*/, "", piece[4])
            refs[n] = refs[n] " " piece[4]
        }
        END {
            for (i = 1; i <= n; i++) {
                m = split(refs[i], ref, " ")
                list = ""
                for (j = 1; j <= m; j++) if (ref[j] in query) list = list "\n" name[ref[j]]
                print op[i] "\t" list "\t"
            }
        }' RS='\n' ORS='\0' "$OPENAPI" | while IFS= read -r -d '' line; do
        printf '%s %s\n' "${line%%$'\t'*}" \
            "$(printf '%s' "${line#*$'\t'}" | tr -d '\t' | sed '/^$/d' | sort | paste -sd, -)"
    done | sort
}

served_routes() {
    "$SRNFD" routes | while read -r method path query; do
        [ "$query" = - ] && query=
        printf '%s %s %s\n' "$method" "$path" "$(printf '%s' "$query" | tr ',' '\n' | sort | paste -sd, -)"
    done | sort
}

# The JSON that stands under a name among the schemas.
schema() { # NAME
    awk -v head="    $1:" '$0 == head { on = 1; next } on && /^    [A-Za-z#]/ { exit } on' "$OPENAPI"
}

start_server "$SCRATCH/data" --workers 1 || exit 1

described_routes >"$SCRATCH/described"
served_routes >"$SCRATCH/served"
compare "$(wc -l <"$SCRATCH/described")" '>=' 20 'the description has operations'
is "$(comm -23 "$SCRATCH/described" "$SCRATCH/served")" '' 'what is described is served, with the same query parameters'
is "$(comm -13 "$SCRATCH/described" "$SCRATCH/served")" '' 'what is served is described, with the same query parameters'

api/generate.sh "$SRNFD" <"$OPENAPI" >"$SCRATCH/generated" 2>"$SCRATCH/errors"
is "$(diff "$OPENAPI" "$SCRATCH/generated" | head -n 20)$(cat "$SCRATCH/errors")" '' \
    'the processes are described as make openapi writes them'
sed '/# end of schemas/d' "$OPENAPI" | api/generate.sh "$SRNFD" >"$SCRATCH/cut" 2>"$SCRATCH/errors"
is "$?$(cat "$SCRATCH/errors")" '1api/generate.sh: the part schemas has no end' 'a part without its end is an error'
get /v1/processes
processes=$(json '.processes[].id' | sort)
is "$(sed -n 's/^    \([a-z-]*\)Inputs:$/\1/p' "$OPENAPI" | sort)" "$processes" 'inputs of the same processes are described'
is "$(sed -n 's/^    \([a-z-][a-z-]*\)Outputs:$/\1/p' "$OPENAPI" | sort)" "$processes" 'outputs of the same processes are described'
# What a description has of an input or output, as the schema of all of them has it: 3.0 back to 2020-12.
# A constant is the same as an enumeration of one.
enumerated='walk(if type == "object" and has("const") then .enum = [.const] | del(.const) else . end)'
as_in_file='def restore: walk(if type == "object" then
        (if .nullable? == true then .type = [.type, "null"] | del(.nullable) else . end)
        | (if .exclusiveMinimum? == true then .exclusiveMinimum = .minimum | del(.minimum) else . end)
    else . end); map_values(.description as $text | .schema | restore | .description = $text)'
for process in $processes; do
    get "/v1/processes/$process"
    for side in Inputs Outputs; do
        is "$(schema "$process$side" | jq -S ".properties | $enumerated")" "$(jq -S ".${side,,} | $as_in_file" "$BODY")" \
            "$process: ${side,,} are described as the table has them"
    done
    is "$(schema "${process}Inputs" | jq -c '.required | sort')" \
        "$(jq -c '.inputs | map_values(select(.minOccurs == 1)) | keys' "$BODY")" "$process: and so is what must be given"
done

# The codes of warnings: those of the table are described, and no others.
codes=$(sed -n '/ codes\[\] = {/,/};/p' server/api/warnings.c | grep -o '"[a-z-]*"' | tr -d '"')
compare "$(wc -w <<<"$codes")" '>=' 2 'there is a table of warnings'
is "$(schema Warning | sed -n 's/^ *enum: \[\(.*\)\]$/\1/p' | tr -d ' ' | tr ',' '\n')" "$codes" \
    'the codes of warnings are listed as the table has them'
is "$(schema Warning | sed -n 's/^            \([a-z-]*\): .*/\1/p')" "$codes" 'and each has its meaning'

get /v1/openapi.yaml
is "$STATUS" 200 'the description is served'
check 'and is the file' cmp "$BODY" "$OPENAPI"
get /v1/openapi.yaml -H "If-None-Match: $(header ETag)"
is "$STATUS" 304 'and need not be sent twice'

get /v1/openapi.json
is "$STATUS $(header Content-Type) $(json '"\(.openapi) \(.paths | length)"')" \
    "200 application/vnd.oai.openapi+json;version=3.0 3.0.3 $(($(grep -c '^  /.*:$' "$OPENAPI") - 1 + $(wc -w <<<"$processes")))" 'it is served in OpenAPI 3.0, too, with the execution of each process by itself'
is "$(json '[.. | objects | select((.type? | type) == "array" or has("const"))] | length')" 0 'without what 3.0 does not have'
is "$(json '. as $all | [.. | objects | select(has("$ref")) | .["$ref"]] | unique | map(select(
        . as $ref | $all | getpath($ref | ltrimstr("#/") | split("/") | map(gsub("~1"; "/"))) == null)) | join(" ")')" '' \
    'and whatever it refers to is in it'
get /v1/docs
is "$STATUS $(header Content-Type) $(grep -c '<h3 id=' "$BODY")" "200 text/html; charset=utf-8 $(wc -l <"$SCRATCH/described")" \
    'and as a page, with every operation'
like "$(header Content-Security-Policy)" "frame-ancestors 'none'" 'that no other page can frame'
is "$(grep -oE '(src|href)="[a-z]*:?//[^"]*"' "$BODY")" '' 'which fetches nothing'

get /v1/meshes/mesh-00000000000000000000000000000000
is "$(jq -r '[.type, .code, .status] | @csv' "$BODY")" '"urn:srnfd:problem:no-such-mesh","no-such-mesh",404' \
    'problems have the members that the description requires'

stop_server || not_ok 'the server ends well'
done_testing
