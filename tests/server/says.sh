# What tests of command lines say: sourced where `program` is set, in a folder of the test's own.
#   fail WORDS...                 ends the test, with what the program said last
#   says CODE WORDS COMMAND...    the program ends with this code and says these words (a pattern of grep; empty: any); ./said has all of it
fail() { echo "FAILED: $*" >&2; cat said >&2; exit 1; }
says() {
  local code=0 wanted=$1 words=$2
  shift 2
  "$program" "$@" > said 2>&1 || code=$?
  [[ $code == "$wanted" ]] || fail "$* ends with $code, not $wanted"
  [[ -z $words ]] || grep -q -e "$words" said || fail "$* does not say '$words'"
}
