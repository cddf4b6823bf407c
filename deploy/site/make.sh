#!/usr/bin/env bash
# The documents as a static site, by Eleventy:  deploy/site/make.sh [FOLDER]    (default: build/site)
# Wants Node.js 18 or newer and npm, and fetches what package-lock.json names into build/site-npm. Links are relative: any web server can host the
# folder, at any path.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${1:-$root/build/site}
work=${SITE_WORK:-$root/build/site-npm}
mkdir -p "$work" "$(dirname "$out")"
out=$(cd "$(dirname "$out")" && pwd)/$(basename "$out")
work=$(cd "$work" && pwd)
if ! cmp -s "$here/package-lock.json" "$work/installed-lock.json"; then
  cp "$here/package.json" "$here/package-lock.json" "$work"
  (cd "$work" && npm ci --prefer-offline --ignore-scripts --no-audit --no-fund --loglevel=error)
  cp "$here/package-lock.json" "$work/installed-lock.json"
fi
rm -rf "$work/pages" "$out"
python3 "$here/stage.py" "$root" "$work/pages" "$out"
mkdir -p "$work/pages/_includes"
cp "$here/page.njk" "$work/pages/_includes/"
cp "$here/eleventy.config.mjs" "$work/"
cp "$here/style.css" "$work/node_modules/mermaid/dist/mermaid.min.js" "$out/"
(cd "$work" && ELEVENTY_OUTPUT=$out node node_modules/@11ty/eleventy/cmd.cjs --config=eleventy.config.mjs --quiet)
