# For shell tests, sourced after `cd` to the project's root: counts and says what passed.
RT=${RT:-./rt}
# The files of this run, which another one of the same script doesn't touch.
mkdir -p build/test-tmp && TMP=$(mktemp -d "build/test-tmp/$(basename "$0" .sh).XXXXXX") || exit 1
chmod 755 "$TMP"
trap 'rm -rf "$TMP"' EXIT
failures=0

ok() { echo "ok $1"; }
not_ok() { echo "not ok $1: $2"; failures=$((failures + 1)); }
skip() { echo "skip $1: $2"; }

# check NAME COMMAND...: passes if the command does; its last line of output is the reason if not.
check() {
    local name=$1 output status
    shift
    output=$("$@" 2>&1)
    status=$?
    if [ $status = 0 ]; then ok "$name"; else not_ok "$name" "$(tail -n 1 <<<"$output") (status $status)"; fi
}

finish() { [ $failures = 0 ]; exit; }
