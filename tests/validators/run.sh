#!/usr/bin/env bash
# Holds tiles and documents of the shipped sample against validators that others wrote: tests/validators/run.sh BUILD
# Exits with 77, and says what is missing, where it cannot run. 3d-tiles-validator is npm's where npm lists it, else the one in
# tools/validators beside the folder of real elevation models (CORDILLERA_TEST_DATA, else ../shared/dem beside the checkout).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/validators/run.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The test of validators'
need_node
modules=$build/validators
node_modules "$here" "$modules"
cp -r "$here"/*.mjs "$here/schemas" "$modules"

# Sets $tiles_validator to a folder, or to nothing. npm is asked once; a package of the folder is unpacked each time.
find_tiles_validator() {
  local packed
  tiles_validator=
  packed=$(ls "$modules"/npm/3d-tiles-validator-*.tgz "${CORDILLERA_TEST_DATA:-$repository/../shared/dem}"/../tools/validators/3d-tiles-validator-*.tgz \
    2>/dev/null | sed -n 1p) || true
  if [[ -z $packed ]]; then
    mkdir -p "$modules/npm"
    packed=$(cd "$modules/npm" && npm pack --silent 3d-tiles-validator@0.6.1 2>/dev/null) || return 0
    packed=$modules/npm/$packed
  fi
  rm -rf "$modules/package"
  tar -xzf "$packed" -C "$modules"
  tiles_validator=$modules/package
}
find_tiles_validator

sample=$repository/deploy/sample/white_mountains_srtm3.tif
program=$build/bin/cordillera
"$program" build "$sample" -o "$work/out" --attribution 'NASA SRTM' --quiet \
  --formats drc,3d-tiles,3d-tiles-explicit,quantized-mesh,terrain-3d,terrain-rgb,terrarium,hillshade
"$program" build "$sample" -o "$work/lit" --normals texture --formats 3d-tiles --quiet
"$program" build "$sample" -o "$work/dark" --normals none --formats 3d-tiles --quiet
"$program" build "$sample" -o "$work/dem.sqlite" --quiet
"$program" export "$work/dem.sqlite" -o "$work/dem.3tz" --quiet
mkdir "$work/meshes"
"$program" export "$work/dem.sqlite" -o "$work/meshes/level.glb" --level 9 --quiet
"$program" export "$work/dem.sqlite" -o "$work/meshes/box.glb" --bbox -71.4,44.2,-71.2,44.3 --frame ecef --quiet
start_server "$build"
id=$(post "$sample")
node "$modules/check.mjs" --static "$work/out" --lit "$work/lit" --dark "$work/dark" --archive "$work/dem.3tz" --meshes "$work/meshes" --dataset "$url/v1/datasets/$id" \
  --tiles-validator "$tiles_validator"
[[ -n $tiles_validator ]] || leave_out '3d-tiles-validator, which npm does not list here; all other validators are content'
