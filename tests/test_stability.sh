#!/usr/bin/env bash
# The quick subset of the stiff and extreme cases; `make stability` runs them in full.
cd "$(dirname "$0")/.." && . tests/support/shell.sh

build/release/tests/stability/stability >"$TMP/table"
status=$?
awk '/^ *[0-9]+  / { name = substr($0, 5, 44); sub(/ +$/, "", name); n = $0 }
     /^ *[0-9]+  / { split(substr($0, 61), f, " "); print (f[2] == 0 && f[1] > 0 ? "ok " : "not ok ") name (f[2] ? ": " f[2] " failures" : "") }
     /^    first/ { print }
     /^    the program/ { print }
     /^    too many/ { print "not ok " name ": too many undecided" }' "$TMP/table"
[ $status -le 1 ] || not_ok "the table" "status $status"
