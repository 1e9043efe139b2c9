#!/usr/bin/env bash
# Puts what the tables of the processes say into the description of the API: "make openapi".
#
#   api/generate.sh SRNFD <openapi.yaml >new.yaml
#
# SRNFD is the daemon's program: "srnfd processes" prints a line of JSON a process. Between the lines
# "# make openapi: NAME" and "# end of NAME" everything is written anew; the rest is copied. The parts:
#
#   ids       the processes, for the parameter of their routes
#   inputs    a reference to the inputs of each        outputs   the same of their results
#   schemas   both, without $schema
set -euo pipefail
export LC_ALL=C
srnfd=${1:?usage: api/generate.sh SRNFD}
processes=$("$srnfd" processes)

references() { # SIDE INDENT
    jq -r --arg side "$1" --arg indent "$2" '$indent + "- $ref: '"'"'#/components/schemas/" + .id + $side + "'"'"'"' <<<"$processes"
}

# jq's layout, with arrays of words and numbers on one line.
laid_out() { # SIDE
    jq "$1 | del(.\"\$schema\")" | awk '
        { item = $0; sub(/^ */, "", item) }
        open && item ~ /[[{]$/ { print held; open = 0 }
        open && item ~ /^\],?$/ { print line item; open = 0; next }
        open { line = line item (item ~ /,$/ ? " " : ""); held = held "\n" $0; next }
        /\[$/ { open = 1; held = line = $0; next }
        { print }'
}

schemas() {
    local line id side
    while IFS= read -r line; do
        id=$(jq -r .id <<<"$line")
        for side in Inputs Outputs; do
            printf '    %s%s:\n' "$id" "$side"
            laid_out ".${side,}" <<<"$line" | sed 's/^/      /'
        done
    done <<<"$processes"
}

part() { # NAME
    case $1 in
    ids) printf '      schema: {enum: [%s]}\n' "$(jq -rs 'map(.id) | join(", ")' <<<"$processes")" ;;
    inputs) references Inputs '            ' ;;
    outputs) references Outputs '        ' ;;
    schemas) schemas ;;
    *) echo "api/generate.sh: no part is named $1" >&2 && return 1 ;;
    esac
}

skipping=
while IFS= read -r line; do
    case $line in
    *'# make openapi: '*)
        printf '%s\n' "$line"
        skipping=${line##*: }
        part "$skipping"
        ;;
    *"# end of $skipping")
        skipping=
        printf '%s\n' "$line"
        ;;
    *) [ -n "$skipping" ] || printf '%s\n' "$line" ;;
    esac
done
[ -z "$skipping" ] || { echo "api/generate.sh: the part $skipping has no end" >&2 && exit 1; }
