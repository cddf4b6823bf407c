#!/usr/bin/env bash
# nginx with deploy/nginx.conf before the service: nginx_front.sh BUILD. Names, ports and the certificate are replaced, nothing else.
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/deploy/nginx_front.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The test of nginx before the service'
nginx=$(command -v nginx || command -v /usr/sbin/nginx) || leave_out nginx
command -v openssl >/dev/null || leave_out openssl

fail() { printf '%s\n' "$1" >&2; cat "$work/server.log" "$work/nginx.log" >&2; exit 1; }
word() { sed -n "s/^$1: *//p"; }

"$build/bin/cordillera" token new --name writer --role write --file "$work/tokens" >"$work/made" 2>/dev/null
token=$(word token <"$work/made")
start_server "$build" --tokens "$work/tokens" --trusted-proxies 127.0.0.1
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
front=https://127.0.0.1:$port

openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=127.0.0.1 -keyout "$work/key.pem" -out "$work/certificate.pem" 2>/dev/null
sed -e "s#server 127.0.0.1:8080#server ${url#http://}#" -e "s#listen 443 ssl http2#listen 127.0.0.1:$port ssl http2#" -e '/listen \[::\]/d' \
  -e "s#ssl_certificate /.*;#ssl_certificate $work/certificate.pem;#" -e "s#ssl_certificate_key /.*;#ssl_certificate_key $work/key.pem;#" \
  "$repository/deploy/nginx.conf" >"$work/site.conf"
# Workers of another user could not reach the test's folder.
cat >"$work/nginx.conf" <<CONF
$([[ $(id -u) -ne 0 ]] || printf 'user root;')
daemon off;
master_process off;  # one process, so that it ends with the test whatever happens
pid $work/nginx.pid;
error_log $work/nginx.log warn;
events {}
http {
  access_log off;
  client_body_temp_path $work/client; proxy_temp_path $work/proxy; fastcgi_temp_path $work/fastcgi; uwsgi_temp_path $work/uwsgi; scgi_temp_path $work/scgi;
  include $work/site.conf;
}
CONF
start "$nginx" -p "$work" -c "$work/nginx.conf" 2>>"$work/nginx.log"
nginx_pid=$started
ask() { curl -ksS -m 120 "$@"; }
until ask -o "$work/alive" "$front/healthz" 2>/dev/null; do
  kill -0 "$nginx_pid" || fail 'nginx did not start'
  sleep 0.1
done

# Who may write is asked for behind the proxy too; a token is handed on.
status() { ask -o "$work/answer" -w '%{http_code}' "$@"; }
sample=$repository/deploy/sample/white_mountains_srtm3.tif
[[ $(status -T "$sample" -X POST "$front/v1/datasets?name=a.tif") == 401 ]] || fail 'a post without a token should be refused'
grep -q '"urn:cordillera:problem:token-missing"' "$work/answer" || fail 'the problem does not come through'

# An upload larger than what nginx takes by itself, and events while its build goes on.
head -c 3000000 /dev/zero >"$work/zeros.tif"
[[ $(status -T "$work/zeros.tif" -X POST -H "Authorization: Bearer $token" "$front/v1/datasets?name=zeros.tif") == 202 ]] || fail 'a post of 3 MB should be taken'
[[ $(status -T "$sample" -X POST -H "Authorization: Bearer $token" -H 'X-Forwarded-For: 192.0.2.66' "$front/v1/datasets?name=sample.tif&error=20") == 202 ]] ||
  fail 'a post with a token should be taken'
id=$(json_id <"$work/answer")
ask -N "$front/v1/datasets/$id/events" >"$work/events" || fail 'the events broke off'
grep -q '^event: ready' "$work/events" || fail 'no event: ready'
# It could be told as it went: what was said first was not kept until the end.
grep -q '^event: progress' "$work/events" || fail 'no event: progress'

# Tiles are the same bytes, with their tags; documents name the public address.
path=/v1/datasets/$id/$("$cordillera" fetch "$id" --middle -o "$work/fetched/")
ask -D "$work/head" -o "$work/through" "$front$path" && curl -fsS -o "$work/direct" "$url$path"
cmp "$work/through" "$work/direct" || fail 'a tile through nginx has other bytes'
etag=$(tr -d '\r' <"$work/head" | word '[Ee][Tt]ag')
[[ $(status -H "If-None-Match: $etag" "$front$path") == 304 ]] || fail 'an unchanged tile should cost a 304'
grep -qi '^x-content-type-options: nosniff' "$work/head" || fail 'a safe header got lost'
[[ $(ask "$front/v1/datasets/$id/terrain-rgb.json") == *"\"$front/v1/datasets/$id/"* ]] || fail 'terrain-rgb.json does not name the public address'
[[ $(ask -H 'X-Forwarded-Prefix: /made-up' -H 'X-Forwarded-Host: made.up' "$front/v1/datasets/$id/terrain-rgb.json") == *"\"$front/v1/datasets/$id/"* ]] ||
  fail 'a client could put its own address into terrain-rgb.json'
[[ $(status "$front/") == 200 ]] || fail 'the viewer does not come through'
[[ $(status "$front/metrics") == 404 ]] || fail 'metrics are not for strangers'

# The audit names the client that nginx saw, not the one that the client made up; and nginx's own request id.
grep -q '"client":"127.0.0.1"' "$work/data/audit.jsonl" || fail 'the audit does not name the client'
grep -q '192.0.2.66' "$work/data/audit.jsonl" && fail 'a client could forge its address'
grep -qE '"request":"[0-9a-f]{32}"' "$work/data/audit.jsonl" || fail 'the request id of nginx did not arrive'
printf 'nginx before the service: uploads, events, tiles and tags come through\n'
