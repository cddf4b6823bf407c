#!/usr/bin/env bash
# deploy/tag.sh in a repository of its own, and the files for GitHub: what they run is there, and they are YAML.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
fail() { printf 'release_files: %s\n' "$*" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

mkdir -p "$work/repository/deploy"
cp "$root/deploy/tag.sh" "$work/repository/deploy"
cd "$work/repository"
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null GIT_AUTHOR_NAME=a GIT_AUTHOR_EMAIL=a@b GIT_COMMITTER_NAME=a GIT_COMMITTER_EMAIL=a@b
git init -q .
printf 'project(cordillera VERSION 1.2.3)\n' >CMakeLists.txt
printf '# Changelog\n\n## 1.2.3 (unreleased)\n\n### New\n\n* A thing.\n\n## 1.2.2 (2026-01-01)\n\n* Older.\n' >CHANGELOG.md
git add -A && git commit -qm one
refused() { ! deploy/tag.sh "$1" >/dev/null 2>../error || fail "version $1 was tagged"; grep -q "$2" ../error || fail "another reason than '$2': $(<../error)"; }
refused 1.2 'a version such as'
refused 1.2.3 unreleased
refused 1.2.2 'another version'
sed -i 's/unreleased/2026-02-03/' CHANGELOG.md
refused 1.2.3 'not committed'
git commit -qam two
[[ $(deploy/tag.sh 1.2.3) == v1.2.3 ]] || fail "1.2.3 was not tagged"
[[ $(git tag -l --format='%(contents)' v1.2.3) == $'### New\n\n* A thing.' ]] || fail "the notes of the tag are: $(git tag -l --format='%(contents)' v1.2.3)"
deploy/tag.sh --notes 1.2.2 | grep -q Older || fail "--notes does not print the section"

cd "$root"
while read -r script; do
  [[ -x $script ]] || fail "a workflow runs $script, which is not there"
done < <(grep -hoE '\b(deploy|tests)/[a-z_/]+\.sh' .github/workflows/*.yml .devcontainer/devcontainer.json | sort -u)
for preset in $(grep -hoE -- '--preset [a-z-]+' .github/workflows/*.yml .devcontainer/devcontainer.json | cut -d' ' -f2 | sort -u); do
  grep -q "\"name\": \"$preset\"" CMakePresets.json || fail "there is no preset $preset"
done
python3 -c 'import json, sys; json.load(open(sys.argv[1]))' .devcontainer/devcontainer.json
if python3 -c 'import yaml' 2>/dev/null; then
  find .github -name '*.yml' -print0 | xargs -0 -n1 python3 -c 'import sys, yaml; assert yaml.safe_load(open(sys.argv[1]))'
fi
echo "ok"
