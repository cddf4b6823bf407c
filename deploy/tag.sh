#!/usr/bin/env bash
# Tags a release:  deploy/tag.sh 1.2.3
#   Wants a clean tree, that version in CMakeLists.txt, and a section "## 1.2.3" of CHANGELOG.md that no longer says "unreleased". The tag is
#   annotated with that section. Nothing is pushed: `git push origin v1.2.3` does it, and CI makes the packages and a draft of the release.
#   deploy/tag.sh --notes 1.2.3    only prints the section
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
fail() { printf 'tag: %s\n' "$*" >&2; exit 1; }
notes() { awk -v want="## $1" '$0 == want || index($0, want " ") == 1 { on = 1; next } /^## / { on = 0 } on' CHANGELOG.md | sed '/./,$!d'; }

if [[ ${1:-} == --notes ]]; then
  [[ -n $(notes "${2:-}") ]] || fail "CHANGELOG.md has no section ## ${2:-}"
  notes "$2"
  exit
fi
version=${1:-}
[[ $version =~ ^[0-9]+\.[0-9]+\.[0-9]+$ ]] || fail "a version such as 1.2.3 is wanted, not '$version'"
[[ -z $(git status --porcelain) ]] || fail "the tree has changes that are not committed"
grep -qE "VERSION $version\b" CMakeLists.txt || fail "CMakeLists.txt has another version"
heading=$(grep -E "^## $version( |\$)" CHANGELOG.md) || fail "CHANGELOG.md has no section ## $version"
[[ $heading != *unreleased* ]] || fail "CHANGELOG.md calls $version unreleased: put the date in its place"
# Headings begin with #, which git would take for comments.
notes "$version" | git tag -a --cleanup=verbatim -F - "v$version" || fail "git made no tag"
echo "v$version"
