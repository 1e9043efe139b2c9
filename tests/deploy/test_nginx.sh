#!/usr/bin/env bash
# The nginx example in front of a daemon: with its listen directive turned into a unix socket and its upstream into
# the daemon's port, it passes requests, names and bodies on. Skipped without nginx, which
# deploy/install-deps.sh --tests unpacks into build/tools.
. "$(dirname "$0")/../support/lib.sh"

NGINX=$(PATH=$PATH:/usr/sbin:$ROOT/build/tools/usr/sbin command -v nginx) || skip_all 'no nginx'

start_server "$SCRATCH/data" --allowed-hosts shapes.example.org --insecure || exit 1
SOCKET=$SCRATCH/nginx.sock
{
    echo "daemon off; pid $SCRATCH/nginx.pid; error_log $SCRATCH/nginx.log; worker_processes 1;"
    [ "$(id -u)" -ne 0 ] || echo "user $(id -un);"
    echo "events { worker_connections 64; } http { access_log off;"
    for part in client_body proxy fastcgi uwsgi scgi; do echo "${part}_temp_path $SCRATCH/$part;"; done
    sed -e "s#server 127.0.0.1:8080;#server ${URL#http://};#" -e "s#listen 443 ssl;#listen unix:$SOCKET;#" \
        -e '/ssl_certificate/d' deploy/nginx.conf
    echo '}'
} >"$SCRATCH/nginx.conf"
check 'the example is valid' "$NGINX" -t -c "$SCRATCH/nginx.conf" -e "$SCRATCH/nginx.log"
"$NGINX" -c "$SCRATCH/nginx.conf" -e "$SCRATCH/nginx.log" </dev/null >/dev/null 2>&1 &
NGINX_PID=$!
SERVER_PIDS+=("$NGINX_PID")
for _ in $(seq 100); do
    [ -S "$SOCKET" ] && break
    sleep 0.05
done

DIRECT=$URL
URL=http://shapes.example.org
THROUGH=(--unix-socket "$SOCKET")
get /readyz "${THROUGH[@]}"
is "$STATUS" 200 'the daemon answers through nginx'
post '/v1/meshes?format=ply' "${THROUGH[@]}" --data-binary @tests/data/aal_subcortex/L_thalamus.ply
is "$STATUS" 201 'a mesh goes through'
mesh=$(json .id)
execute encode "{\"mesh\":\"$mesh\",\"lmax\":8}" "${THROUGH[@]}"
is "$STATUS" 200 'an execution is waited for'
WAITED=$(sed -n '/location \/ {/,/}/ s/.*proxy_read_timeout \([0-9]*\)s;.*/\1/p' deploy/nginx.conf)
compare "${WAITED:-0}" '>' 300 'and longer than Prefer: wait may ask for'
STREAMS=$(sed -n 's/.*location ~ \(.*\) {/\1/p' deploy/nginx.conf)
for path in "/v1/jobs/job-1/events" /v1/events; do
    like "$path" "$STREAMS" "$path is passed on as a stream"
done
head -c 3000000 /dev/zero >"$SCRATCH/large"
post '/v1/meshes?format=ply' "${THROUGH[@]}" --data-binary "@$SCRATCH/large"
is_problem 422 unparsable-mesh 'a large body goes through, and its refusal comes back'
get "/v1/meshes/$mesh/content" "${THROUGH[@]}"
check 'content comes back as it is' cmp "$BODY" tests/data/aal_subcortex/L_thalamus.ply
URL=http://other.example.org
get /readyz "${THROUGH[@]}"
is "$STATUS" 403 'another name is refused by the daemon'

kill -QUIT "$NGINX_PID"
wait "$NGINX_PID" 2>/dev/null
URL=$DIRECT
if stop_server; then ok 'the daemon drains'; else not_ok 'the daemon drains'; fi
done_testing
