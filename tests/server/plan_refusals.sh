#!/usr/bin/env bash
# What a plan says of rasters that do not fit, and what a worker refuses: tests/server/plan_refusals.sh BUILD
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
program=$(cd "${1:?usage: tests/server/plan_refusals.sh BUILD}" && pwd)/bin/cordillera
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
. "$here/says.sh"
options=(--max-level 13 --error 4 -q)
python3 "$here/../slurm/make_rasters.py" dem 3

# A broken raster ends the plan and is named; or it is left out, and the plan says so.
echo 'ncols 7' > dem/dem99.asc
says 1 dem99.asc plan dem -o plan "${options[@]}" --vertical-datum ellipsoid
[[ ! -e plan/plan.json ]] || fail 'a plan was written'
says 0 'left out: .*dem99.asc' plan dem -o plan "${options[@]}" --vertical-datum ellipsoid --skip-bad
grep -q '"skipped": *\["[^"]*dem99.asc' plan/plan.json || fail 'the plan does not record it'
# Rasters are examined in any order, and the first bad one is named.
for number in 90 91 92 93 94 95 96 97 98; do echo 'ncols 7' > dem/dem$number.asc; done
says 1 dem90.asc plan dem -o plan "${options[@]}" --vertical-datum ellipsoid
says 0 'left out: .*dem99.asc' plan dem -o plan "${options[@]}" --vertical-datum ellipsoid --skip-bad
[[ $(sed -n 's/.*left out: [^:]*\(dem9[0-9]\).asc: .*/\1/p' said | tr '\n' ' ') == 'dem90 dem91 dem92 dem93 dem94 dem95 dem96 dem97 dem98 dem99 ' ]] ||
  fail 'those left out are not named in their order'
rm dem/dem9?.asc

# A box beside all of them, or in another order, is told where they lie together.
"$program" info dem --json > said
order=$(python3 -c 'import json; w, s, e, n = json.load(open("said"))["manifest"]["source"]["bbox"]; print(f"{s:.4f},{w:.4f},{n:.4f},{e:.4f}")')
says 1 'the bbox touches none of the 3 rasters; in the order west,south,east,north it would: ' plan dem --dry-run --bbox "$order"
says 1 'touches none of the 3 rasters; accepted: a bbox over the data, which lie in ' plan dem --dry-run --bbox 100,10,101,11

# A plan is text, and so are the names in it.
for kind in asc prj; do cp dem/dem00.$kind $'caf\xe9.'$kind; done
says 1 'the name of café.asc is no UTF-8' plan $'caf\xe9.asc' -o latin "${options[@]}" --vertical-datum ellipsoid

# A raster without data among others is named, and the rest is built.
cp dem/dem00.prj void.prj
sed '7,$s/[-0-9.][-0-9.]*/-9999/g' dem/dem00.asc > void.asc
says 0 'warning: 1 of 2 rasters has no data, which is no height within 16384 m of zero: void.asc' plan void.asc dem/dem01.asc -o void "${options[@]}" --vertical-datum ellipsoid
says 0 'note  *1 of 2 rasters has no data, which is no height within 16384 m of zero: void.asc' build void.asc dem/dem01.asc -o void.sqlite --max-level 13 --error 4 --vertical-datum ellipsoid
says 0 '"all_void": true' info void.sqlite --json

# Two rasters of one place above different datums.
cat > two.txt << 'EOF'
dem/dem00.asc vertical_datum=EGM96
dem/dem00.asc vertical_datum=ellipsoid
EOF
says 0 'warning: dem00.asc counts from EGM96.*are [0-9.]* m apart' plan two.txt -o two "${options[@]}"
[[ $(sed -n 's/.*are \([0-9]*\)\..* m apart.*/\1/p' said) -gt 10 ]] || fail 'they are about 50 m apart there'

# Of four, those are compared that meet, in the order in which they are named.
cat > four.txt << 'EOF'
dem/dem01.asc vertical_datum=EGM96
dem/dem00.asc vertical_datum=ellipsoid
dem/dem01.asc vertical_datum=ellipsoid
dem/dem00.asc vertical_datum=EGM96
EOF
says 0 '' plan four.txt -o four "${options[@]}"
[[ $(sed -n 's/.*warning: \(dem..\).asc counts from \([A-Za-z0-9]*\) .*, \(dem..\).asc from \([A-Za-z0-9]*\) .*/\1 \2 \3 \4/p' said) == \
  $'dem01 EGM96 dem01 ellipsoid\ndem00 ellipsoid dem00 EGM96' ]] || fail 'other pairs are warned of'

# A geoid that is another one where the task is done.
grid() { # metres
  python3 - "$1" << 'EOF'
import struct, sys
rows = columns = 40
with open("own.gtx", "wb") as out:
    out.write(struct.pack(">4d2i", 40.0, 0.0, 0.5, 0.5, rows, columns) + struct.pack(">f", float(sys.argv[1])) * rows * columns)
EOF
}
grid 40
says 0 '' plan dem -o geoid "${options[@]}" --vertical-datum "$work/own.gtx"
grid 41
says 1 'the geoid grid for .*differs' work geoid -q
grid 40
says 0 '' work geoid -q

# Tasks that are not done yet may be so later, and nobody guesses which part of an array this is.
says 0 '' plan dem -o here "${options[@]}" --vertical-datum ellipsoid
says 75 '1 task has not been done' publish here -o here.sqlite
unset SLURM_ARRAY_TASK_ID JOB_COMPLETION_INDEX AWS_BATCH_JOB_ARRAY_INDEX
says 2 'no scheduler says which part' work here --stage 0 --part array/3
says 0 '' work here --stage 0 --part array/1 -q

# The rasters of a plan are found from any folder.
mkdir elsewhere
(cd elsewhere && "$program" work ../here -q > ../said 2>&1) || fail 'tasks cannot be done in another folder'
says 0 '' publish here -o out -q
says 0 '3 rasters: each 160 x 160' info out

# A place that cannot be written will not be one later; the folders above a folder are made, as build makes them.
says 1 'there is no folder .*dem00.asc' publish here -o dem/dem00.asc/out.sqlite
says 1 'cannot create .*dem00.asc: Not a directory' publish here -o dem/dem00.asc/out
says 1 "there is no folder $work/nowhere" publish here -o nowhere/out.sqlite
says 0 '' publish here -o new/folders/out -q
[[ -e new/folders/out/tileset.json ]] || fail 'there is no tile set'

# What has another size or date is told with both; what is not there, with its whole path.
mkdir alone && cp dem/dem00.* alone && rm -rf one
says 0 '' plan alone/dem00.asc -o one "${options[@]}" --vertical-datum ellipsoid
touch -d '2001-02-03 04:05:06.789 UTC' alone/dem00.asc
says 1 'bytes of 2[-0-9]* [0-9:.]* UTC, .*now [0-9]* bytes of 2001-02-03 04:05:06.789 UTC' work one -q
says 0 '^1 raster, levels' tasks one
rm alone/dem00.asc
says 1 "$work/alone/dem00.asc" work one -q
grep -q '"name":"dem00.asc","sources"' one/plan.json || fail 'a single raster does not give its name'

# A plan is written to a folder that is a plan's, and only when it is asked for.
says 1 'dem00.asc is there and no folder' plan dem -o dem/dem00.asc "${options[@]}" --vertical-datum ellipsoid
says 1 'dem holds something else than a plan' plan dem -o dem "${options[@]}" --vertical-datum ellipsoid
says 0 'dry run: nothing was built' plan dem -o dry --dry-run "${options[@]}" --vertical-datum ellipsoid
says 0 'dry run: nothing was built' plan dem --dry-run "${options[@]}" --vertical-datum ellipsoid
! grep -q 'about less' said || fail 'that is no time'
[[ ! -e dry ]] || fail 'a dry run writes a plan'
says 2 'one of the two' work here --stage 0 --task 0 --part 0/2
says 2 '--part is a part of one stage, .*accepted: --stage 0' work here --part 0/2
says 2 '--task is one task of one stage, .*accepted: --stage 0' work here --task 0

# While one publishes, another one leaves its work alone and may try again.
touch twice.sqlite.publishing
flock twice.sqlite.publishing.lock "$program" publish here -o twice.sqlite -q > said 2>&1 && code=0 || code=$?
[[ $code == 75 ]] && grep -q 'another process is writing .*/twice.sqlite' said || fail "a second publish ends with $code"
[[ -e twice.sqlite.publishing ]] || fail "a second publish removes the first one's work"
says 0 '' publish here -o twice.sqlite -q
[[ ! -e twice.sqlite.publishing.lock ]] || fail 'publish leaves its lock'

# A name says what is written, as for build.
says 2 'publish writes no such file as out.png' publish here -o out.png
says 2 'publish writes no such file as out.sqlite3' publish here -o out.sqlite3
says 0 '' publish here -o out.pmtiles --formats terrain-rgb -q
[[ $(head -c 7 out.pmtiles) == PMTiles ]] || fail 'that is no archive'
[[ ! -e out.pmtiles.publishing.sqlite ]] || fail 'the dataset of an archive stays'

# What is no tile, or no dataset, is told what is taken.
says 0 '' publish here -o out.glb -q
says 1 'its JSON is not that of a tile in tiles/; accepted: a .drc or .glb tile' decode out.glb
says 1 'it is neither a .drc nor a .glb tile' decode dem/dem00.asc
says 1 'here is a plan' check here
echo PK > out.3tz
says 1 'out.3tz is an archive of 3D Tiles' info out.3tz

# Who hands a plan to a scheduler is told in a sentence where the program is missing.
! "$here/../../deploy/kubernetes/jobs.py" here -o out --image cordillera --program missing > said 2>&1 || fail 'there is no such program'
[[ $(< said) == 'jobs.py: missing is not in PATH; say --program' ]] || fail 'jobs.py does not say so'

# What a client reads before any tile of a folder is checked as well.
says 0 'sound' check out
cp -r out cut && rm cut/tileset.json
says 1 'tileset.json: it is missing' check cut
rm -r cut && cp -r out cut && for subtree in $(find cut -name '*.subtree'); do truncate -s -1 "$subtree"; done
says 1 'it is no subtree file' check cut
rm -r cut && cp -r out cut && python3 - << 'EOF'
import glob, re
for name in glob.glob("cut/subtrees/*/0/*/*.subtree"):
    with open(name, "r+b") as file:
        named = re.sub(rb'"childSubtreeAvailability":\{[^}]*\}',
                       lambda found: b'"childSubtreeAvailability":{"constant":0}'.ljust(len(found[0])), file.read())
        file.seek(0)
        file.write(named)
EOF
says 1 'it does not name the subtree .*, which is there' check cut

# Another version of the program.
sed -i 's/"program": *"[^"]*"/"program":"cordillera 0.0.1"/' geoid/plan.json
says 1 'was made by cordillera 0.0.1' work geoid -q
