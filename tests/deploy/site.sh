#!/usr/bin/env bash
# deploy/site/make.sh makes a site of the pages, and every link within it leads somewhere. Exits with 77 where npm or its registry is missing.
#   site.sh BUILD
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/deploy/site.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The site'
need_node git
work=$build/site-npm
node_modules "$repository/deploy/site" "$work"
cp "$repository/deploy/site/package.json" "$repository/deploy/site/package-lock.json" "$work"
cp "$work/package-lock.json" "$work/installed-lock.json"
git -C "$repository" rev-parse >/dev/null 2>&1 || leave_out 'a git repository'

SITE_WORK=$work "$repository/deploy/site/make.sh" "$build/site" >"$build/site.log" 2>&1 || { cat "$build/site.log"; exit 1; }
python3 "$here/site.py" "$build/site"
# The judge sees what is broken.
rm "$build/site/docs/formats/drc.html"
if python3 "$here/site.py" "$build/site" >/dev/null; then echo 'a missing page was not noticed'; exit 1; fi
