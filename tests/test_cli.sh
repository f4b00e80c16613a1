#!/usr/bin/env bash
# The command line: options, exit codes, messages, what is written where. Bad scenes are tests/bad/*.lua: their first line
# has the exit code and all of standard error: "-- expect 1: tests/bad/x.lua:3: ...".
cd "$(dirname "$0")/.." && . tests/support/shell.sh

SCENE=$TMP/scene.lua
cat >"$SCENE" <<'LUA'
local root = gr.node('root')
local ball = gr.sphere('ball')
ball:set_material(gr.reflective_material({0.7, 0.2, 0.2}, {0.5, 0.5, 0.5}, 20, 0.3))
root:add_child(ball)
local floor = gr.nh_box('floor', {-5, -7, -5}, 6)
floor:set_material(gr.material({0.2, 0.7, 0.2}, {0, 0, 0}, 1))
root:add_child(floor)
local light = gr.light({5, 5, 5}, {0.8, 0.8, 0.8}, {1, 0, 0})
for i = 1, tonumber(arg[1] or 1) do
  gr.render(root, (arg[2] or '') .. 'scene' .. i .. '.png', 64, 48, {0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 50,
            {0.3, 0.3, 0.3}, {light})
end
LUA

# expect NAME STATUS STDERR ARGUMENTS...: runs rt; standard error must be this text, standard output empty.
expect() {
    local name=$1 status=$2 text=$3 got
    shift 3
    timeout 100 "$RT" "$@" >"$TMP/out" 2>"$TMP/err" </dev/null
    got=$?
    if [ $got != "$status" ]; then not_ok "$name" "status $got, not $status: $(head -n 1 "$TMP/err")"
    elif [ "$(cat "$TMP/err")" != "$text" ]; then not_ok "$name" "'$(cat "$TMP/err")' and not '$text'"
    elif [ -s "$TMP/out" ]; then not_ok "$name" "standard output: $(head -n 1 "$TMP/out")"
    else ok "$name"; fi
}
# usage NAME TEXT ARGUMENTS...: a mistake in the command line.
usage() { expect "$1" 2 "rt: $2; see rt --help" "${@:3}"; }
# size FILE: width and height in a PNG's header.
size() { od -An -tu1 -j16 -N8 "$1" | awk '{ print $3 * 256 + $4 "x" $7 * 256 + $8 }'; }
is() { if [ "$2" = "$3" ]; then ok "$1"; else not_ok "$1" "'$2' and not '$3'"; fi; }
no_leftovers() { is "$1" "$(find "$TMP" -name '.rt-*')" ""; }

# ---- bad scenes: one line, and the old picture is left alone ----
for scene in tests/bad/*.lua; do
    read -r _ _ status text <"$scene"
    echo old >"$TMP/old.png"
    expect "$scene" "${status%:}" "$text" -q "$scene" -o "$TMP/old.png"
    [ "$(cat "$TMP/old.png")" = old ] || not_ok "$scene" "the old picture is gone"
done
{ printf 'v '; head -c 100000000 /dev/zero | tr '\0' 1; } >"$TMP/line.obj"
sed 's/missing.obj/line.obj/; s/obj\///' tests/bad/mesh_missing.lua >"$TMP/line.lua"
timeout 100 "$RT" -q "$TMP/line.lua" -o "$TMP/old.png" >"$TMP/out" 2>"$TMP/err"
is "100 MB of one line: status" $? 3
is "100 MB of one line: one line" "$(wc -l <"$TMP/err") $(cut -c1-$((${#TMP} + 13)) "$TMP/err")" "1 $TMP/line.obj:1: "
rm -f "$TMP/line.obj"

# ---- the command line ----
usage "no scene" "no scene is given"
usage "two scenes" "one scene at a time, not 'b.lua' too (words for the script stand after --)" a.lua b.lua
usage "unknown option" "unknown option --smaples (did you mean --samples?)" --smaples 3 "$SCENE"
usage "unknown option, nothing near" "unknown option --xylophone" "$SCENE" --xylophone=3
usage "unknown letter" "unknown option -z" -z "$SCENE"
usage "missing value" "-s needs a value" "$SCENE" -s
usage "missing long value" "--stats needs a value" "$SCENE" --stats
usage "needless value" "--check takes no value" --check=yes "$SCENE"
for bad in 0 -1 1.5 9x 65537 99999999999999999999 ''; do
    usage "samples '$bad'" "-s must be an integer from 1 to 65536, not '$bad'" "$SCENE" -s "$bad"
done
for bad in 0 1025 x; do usage "threads '$bad'" "-t must be an integer from 1 to 1024, not '$bad'" "$SCENE" -t "$bad"; done
for bad in -1 1001 x; do
    usage "depth '$bad'" "--max-depth must be an integer from 0 to 1000, not '$bad'" "$SCENE" --max-depth "$bad"
done
usage "seed" "--seed must be an integer from 0 to 2^64 - 1, not '18446744073709551616'" "$SCENE" --seed 18446744073709551616
for bad in 0x0 10 10x 10x10x10 x10 -1x5; do
    usage "size '$bad'" "--size must be WxH, at least 1x1, not '$bad'" "$SCENE" --size "$bad"
done
expect "size 10^6 x 10^6" 5 "rt: --size 1000000x1000000: the limits are 65535 pixels a side and 268435456 in all" \
    "$SCENE" --size 1000000x1000000
for bad in 1,2,3 5,0,5,9 9,0,3,9 0,0,1,1,1 a,b,c,d; do
    usage "crop '$bad'" "--crop must be X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1, not '$bad'" "$SCENE" --crop "$bad"
done
usage "crop beyond the picture" "--crop reaches beyond the picture of 64 x 48" "$SCENE" --crop 0,0,65,48 -o "$TMP/x.png"
for bad in 1,2 1,2,3,4 a,b,c 1,2,nan 1,2,1e39; do
    usage "background '$bad'" "--background must be R,G,B, not '$bad'" "$SCENE" --background "$bad"
done
usage "empty output" "-o must be a file, not ''" "$SCENE" -o ''
for bad in 0 7 12 17 32 x; do usage "bits '$bad'" "--bits must be 8 or 16, not '$bad'" "$SCENE" --bits "$bad"; done
usage "bits of a PFM" "--bits is for PNG; a PFM has 32" "$SCENE" --bits 16 -o x.pfm
usage "bits of a PFM, by --format" "--bits is for PNG; a PFM has 32" "$SCENE" --bits 16 --format pfm
for bad in 0 -1 nan inf 1e999 x '' '1 '; do
    usage "error '$bad'" "--error must be a number above 0, not '$bad'" "$SCENE" --error "$bad"
    usage "time '$bad'" "--time must be seconds above 0, not '$bad'" "$SCENE" --time "$bad"
done
for goal in "--error 0.1" "--time 9" "--error 0.1 --time 9"; do
    usage "-s and $goal" "-s fixes the samples: it can't stand with --error or --time" "$SCENE" -s 4 $goal
done
for bad in x x.txt .jsonx ''; do
    usage "report '$bad'" "--report must end in .json, .csv or .svg, not '$bad'" "$SCENE" --report "$bad"
done
usage "format" "--format must be png or pfm, not 'jpg'" "$SCENE" --format jpg

"$RT" --help >"$TMP/out" 2>"$TMP/err"
is "help: status" $? 0
is "help: standard error" "$(cat "$TMP/err")" ""
is "help: fits 80 columns" "$(awk 'length > 80' "$TMP/out")" ""
for option in --error --time --no-audit --report --variance --reference -o --size --crop --bits --format -s -t --max-depth --seed --legacy --background --srgb -I --check --stats -q --help --version; do
    grep -qE -- "(^| )$option\b" "$TMP/out" || not_ok "help: $option" "is not in it"
done
is "version" "$("$RT" --version | grep -cE '^rt [0-9]+\.[0-9]+')" 1

# ---- inputs and outputs that can't be ----
expect "missing scene" 3 "rt: can't open $TMP/none.lua: No such file or directory" "$TMP/none.lua"
expect "a folder as a scene" 3 "rt: can't read $TMP: Is a directory" "$TMP"
printf '\33Lua' >"$TMP/bytecode.lua"
expect "bytecode as a scene" 1 "$TMP/bytecode.lua:1: attempt to load a binary chunk (mode is 't')" "$TMP/bytecode.lua"
expect "output folder missing" 4 "rt: can't write $TMP/none/x.png: No such file or directory" "$SCENE" -o "$TMP/none/x.png"
expect "the script's output folder missing" 4 "$SCENE:10: can't write $TMP/none/scene1.png: No such file or directory" \
    "$SCENE" -- 1 "$TMP/none/"
expect "output is a folder" 4 "rt: can't write $TMP/: Is a directory" "$SCENE" -o "$TMP/"
is "into a pipe" "$("$RT" -q "$SCENE" -s 1 -o /dev/stdout | head -c 4 | tail -c 3)" PNG
expect "disk full" 4 "rt: can't write /dev/full: No space left on device" "$SCENE" -o /dev/full
expect "statistics folder missing" 4 "rt: can't write $TMP/none/s.json: No such file or directory" \
    "$SCENE" --stats "$TMP/none/s.json" -o "$TMP/never.png"
is "nothing was rendered for them" "$(ls "$TMP/never.png" 2>/dev/null)" ""
mkdir -p "$TMP/locked" && echo old >"$TMP/locked/old.png" && chmod 444 "$TMP/locked/old.png" && chmod 500 "$TMP/locked"
# Root may write anywhere, unless it gives that up.
mortal=()
[ "$(id -u)" != 0 ] || mortal=(setpriv --bounding-set -dac_override)
if "${mortal[@]}" true 2>/dev/null && ! "${mortal[@]}" test -w "$TMP/locked"; then
    for file in x.png old.png; do
        "${mortal[@]}" "$RT" "$SCENE" -o "$TMP/locked/$file" 2>"$TMP/err"
        is "read-only folder: $file" "$? $(cat "$TMP/err")" "4 rt: can't write $TMP/locked/$file: Permission denied"
    done
else
    skip "read-only folder" "this user may write anywhere"
fi
chmod 700 "$TMP/locked"
echo old >"$TMP/old.png"
(ulimit -f 1; "$RT" -q "$SCENE" --size 640x480 -o "$TMP/old.png" 2>"$TMP/err")
is "file too large: status" $? 4
is "file too large: message" "$(cat "$TMP/err")" "rt: can't write $TMP/old.png: File too large"
is "file too large: the old file stays" "$(cat "$TMP/old.png")" old
no_leftovers "file too large: nothing is left behind"
"$RT" --help >/dev/full 2>"$TMP/err"
is "standard output full" "$? $(cat "$TMP/err")" "4 rt: can't write to standard output: No space left on device"
echo "local t = {} while true do t[#t + 1] = {} end" >"$TMP/hungry.lua"
if [ "$(ulimit -v)" = unlimited ] && (ulimit -v 300000; "$RT" --version) >/dev/null 2>&1; then
    (ulimit -v 300000; timeout 60 "$RT" "$TMP/hungry.lua" 2>"$TMP/err")
    is "memory" "$? $(cat "$TMP/err")" "5 rt: out of memory for $TMP/hungry.lua"
else
    skip "memory" "this build doesn't run under ulimit -v"
fi

# ---- pictures ----
expect "quiet" 0 "" -q "$SCENE" -o "$TMP/whole.png" -t 1
is "size of the script" "$(size "$TMP/whole.png")" 64x48
expect "options on both sides" 0 "" -q -s 9 "$SCENE" -t 3 -o "$TMP/three.png"
check "the same picture from any number of threads" cmp "$TMP/whole.png" "$TMP/three.png"
expect "size" 0 "" -q "$SCENE" --size 20x10 -o "$TMP/small.png"
is "size of the command line" "$(size "$TMP/small.png")" 20x10
expect "crop" 0 "" -q "$SCENE" --crop 10,20,30,25 -o "$TMP/crop.png"
is "size of a crop" "$(size "$TMP/crop.png")" 20x5
expect "crop of all" 0 "" -q "$SCENE" --crop 0,0,64,48 -o "$TMP/all.png"
check "a crop of all is the whole" cmp "$TMP/whole.png" "$TMP/all.png"
for change in "--background 1,0,0" "--srgb" "--max-depth 0" "-s 4" "--seed 7"; do
    expect "option $change" 0 "" -q "$SCENE" $change -o "$TMP/changed.png"
    if cmp -s "$TMP/whole.png" "$TMP/changed.png"; then not_ok "$change changes the picture" "it doesn't"; else ok "$change changes the picture"; fi
done
expect "several renders" 0 "" -q "$SCENE" -o "$TMP/many.png" -- 3
is "several renders: files" "$(cd "$TMP" && echo many*)" "many-2.png many-3.png many.png"
check "several renders: the same picture" cmp "$TMP/many.png" "$TMP/many-3.png"
expect "no extension" 0 "" -q "$SCENE" -o "$TMP/dotted.d" -- 2
is "no extension: files" "$(cd "$TMP" && echo dotted*)" "dotted-2.d dotted.d"
mkdir -p "$TMP/a.b" && expect "a dot in the folder" 0 "" -q "$SCENE" -o "$TMP/a.b/name" -- 2
is "a dot in the folder: files" "$(cd "$TMP/a.b" && echo *)" "name name-2"
expect "check" 0 "" "$SCENE" --check -o "$TMP/checked.png"
is "check writes no picture" "$(ls "$TMP/checked.png" 2>/dev/null)" ""
is "check finds mistakes" "$("$RT" --check tests/bad/no_material.lua 2>&1)" "$(sed -n '1s/-- expect 1: //p' tests/bad/no_material.lua)"
program=$(realpath "$RT")
is "the script's own file" "$(cd "$TMP" && "$program" -q scene.lua && size scene1.png)" 64x48

# ---- 16 bits and floats ----
# depth FILE: bits of a PNG's samples. pfm FILE: the header of a PFM in one line.
depth() { od -An -tu1 -j24 -N1 "$1" | tr -d ' '; }
pfm() { head -n 3 "$1" | tr '\n' ' '; }
expect "16 bits" 0 "" -q "$SCENE" --bits 16 -o "$TMP/deep.png"
is "16 bits: header" "$(depth "$TMP/deep.png") $(depth "$TMP/whole.png")" "16 8"
expect "8 bits" 0 "" -q "$SCENE" --bits 8 -o "$TMP/eight.png"
check "8 bits are the default" cmp "$TMP/whole.png" "$TMP/eight.png"
expect "PFM" 0 "" -q "$SCENE" -o "$TMP/float.pfm"
is "PFM: header" "$(pfm "$TMP/float.pfm")" "PF 64 48 -1.0 "
is "PFM: length" "$(stat -c %s "$TMP/float.pfm")" $((14 + 64 * 48 * 12))
check "16 bits are those of 8" "$RT" compare --tolerance 0.502 "$TMP/deep.png" "$TMP/whole.png"
# but for the highlight, where 16 bits end
check "floats are those of 16 bits" "$RT" compare --tolerance 0.00196 --max-share 0.2 "$TMP/deep.png" "$TMP/float.pfm"
for format in png:--bits=16 pfm:--quiet; do
    name=${format%:*} option=${format#*:}
    expect "$name: threads" 0 "" -q "$SCENE" $option -t 3 -o "$TMP/three.$name"
    if [ $name = png ]; then whole=$TMP/deep.png; else whole=$TMP/float.pfm; fi
    check "$name: any number of threads" cmp "$TMP/three.$name" "$whole"
    expect "$name: crop" 0 "" -q "$SCENE" $option --crop 10,20,30,25 -o "$TMP/crop.$name"
    expect "$name: crop of all" 0 "" -q "$SCENE" $option --crop 0,0,64,48 -o "$TMP/all.$name"
    check "$name: a crop of all is the whole" cmp "$TMP/all.$name" "$whole"
    expect "$name: several renders" 0 "" -q "$SCENE" $option -o "$TMP/m.$name" -- 2
    is "$name: several renders: files" "$(cd "$TMP" && echo m.$name m-*.$name)" "m.$name m-2.$name"
    check "$name: several renders: the same picture" cmp "$TMP/m-2.$name" "$whole"
    echo old >"$TMP/old.$name"
    (ulimit -f 1; "$RT" -q "$SCENE" $option --size 640x480 -o "$TMP/old.$name" 2>"$TMP/err")
    is "$name: file too large" "$? $(cat "$TMP/err") $(cat "$TMP/old.$name")" \
        "4 rt: can't write $TMP/old.$name: File too large old"
    expect "$name: folder missing" 4 "rt: can't write $TMP/none/x.$name: No such file or directory" "$SCENE" $option \
        -o "$TMP/none/x.$name"
done
is "PFM: size of a crop" "$(pfm "$TMP/crop.pfm")" "PF 20 5 -1.0 "
is "16 bits into a pipe" "$("$RT" -q "$SCENE" --bits 16 -o /dev/stdout | cmp - "$TMP/deep.png" && echo same)" same
is "PFM into a pipe" "$("$RT" -q "$SCENE" --format pfm -o /dev/stdout | cmp - "$TMP/float.pfm" && echo same)" same
expect "PNG whatever the name" 0 "" -q "$SCENE" --format png -o "$TMP/x.pfm"
check "PNG whatever the name: it is one" cmp "$TMP/whole.png" "$TMP/x.pfm"
expect "PFM in capitals" 0 "" -q "$SCENE" -o "$TMP/X.PFM"
check "PFM in capitals: it is one" cmp "$TMP/float.pfm" "$TMP/X.PFM"
expect "PFM with --srgb" 0 "" -q --srgb "$SCENE" -o "$TMP/srgb.pfm"
check "PFM with --srgb: linear all the same" cmp "$TMP/float.pfm" "$TMP/srgb.pfm"
expect "16 bits with --srgb" 0 "" -q --srgb --bits 16 "$SCENE" -o "$TMP/srgb.png"
if cmp -s "$TMP/deep.png" "$TMP/srgb.png"; then not_ok "16 bits with --srgb: encoded" "it isn't"; else ok "16 bits with --srgb: encoded"; fi
sed "s/'.png'/'.pfm'/" "$SCENE" >"$TMP/names.lua"
is "PFM by the script's name" "$(cd "$TMP" && "$program" -q --bits 16 names.lua && pfm scene1.pfm)" "PF 64 48 -1.0 "
"$RT" "$SCENE" -t 2 -o "$TMP/a.pfm" 2>"$TMP/err"
is "PFM: summary" "$(grep -c "^$TMP/a.pfm: 64 x 48, 9 samples, " "$TMP/err")" 1

# ---- error and its goals ----
# figure KEY FILE: what a report says, by its last line in CSV: rmse, rmse_low, rmse_high, samples, reference, ...
figure() { awk -F, -v key="$1" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == key) at = i } { last = $at } END { print last }' "$2"; }
# holds EXPRESSION...: of awk
holds() { awk "BEGIN { exit !($*) }"; }
for goal in 0.02 0.005; do
    expect "error $goal" 0 "" -q "$SCENE" --error $goal -t 1 -o "$TMP/goal.png" --report "$TMP/goal.csv"
    high=$(figure rmse_high "$TMP/goal.csv")
    check "error $goal: reached" holds "$high > 0 && $high <= $goal"
    for threads in 2 5; do
        expect "error $goal: -t $threads" 0 "" -q "$SCENE" --error $goal -t $threads -o "$TMP/goals.png" --report "$TMP/goals.csv"
        check "error $goal: -t $threads: the same picture" cmp "$TMP/goal.png" "$TMP/goals.png"
        is "error $goal: -t $threads: the same figures" "$(figure rmse "$TMP/goals.csv") $(figure samples "$TMP/goals.csv")" \
            "$(figure rmse "$TMP/goal.csv") $(figure samples "$TMP/goal.csv")"
    done
done
expect "error without an audit" 0 "" -q "$SCENE" --error 0.01 --no-audit -o "$TMP/goal.png" --report "$TMP/goal.csv"
is "error without an audit: there is none" "$(figure audit "$TMP/goal.csv")" ""
check "error without an audit: reached" holds "$(figure rmse_high "$TMP/goal.csv") <= 0.01"
expect "reference" 0 "" -q "$SCENE" -s 1024 --seed 5 --no-audit -o "$TMP/true.pfm"
for how in "-s 4" "-s 9" "--error 0.01"; do
    expect "$how: reference" 0 "" -q "$SCENE" $how -o "$TMP/a.pfm" --reference "$TMP/true.pfm" --report "$TMP/goal.csv"
    check "$how: the error told is near the true one" \
        holds "($(figure rmse "$TMP/goal.csv") / $(figure reference "$TMP/goal.csv") - 1) ^ 2 < 0.3 ^ 2"
    check "$how: the true error is that of rt compare" "$RT" compare -q "$TMP/a.pfm" "$TMP/true.pfm" \
        --max-rmse "$(awk "BEGIN { print 1.0001 * $(figure reference "$TMP/goal.csv") }")"
done
expect "reference of another size" 2 "rt: $TMP/small.png is 20 x 10 and the picture is 64 x 48; see rt --help" -q "$SCENE" \
    --reference "$TMP/small.png" -o "$TMP/a.png"
expect "reference missing" 3 "rt: can't open $TMP/none.pfm: No such file or directory" -q "$SCENE" --reference "$TMP/none.pfm" \
    -o "$TMP/a.png"
expect "reference of a crop" 0 "" -q "$SCENE" --crop 10,20,30,25 --reference "$TMP/true.pfm" -o "$TMP/a.png"
expect "time" 0 "" -q "$SCENE" --time 0.5 -o "$TMP/a.png" --report "$TMP/goal.csv"
check "time: there is a picture" test "$(size "$TMP/a.png")" = 64x48
for how in "" "--no-audit"; do
    rm -f "$TMP/late.png"
    "$RT" "$SCENE" --size 400x300 --error 1e-7 --time 0.3 $how -o "$TMP/late.png" >"$TMP/out" 2>"$TMP/err"
    is "out of time $how: status" $? 6
    is "out of time $how: the picture" "$(size "$TMP/late.png")" 400x300
    is "out of time $how: told" "$(head -n 1 "$TMP/err")" \
        "rt: warning: the time ended before the RMSE of $TMP/late.png was known to be at most 1e-07"
    check "out of time $how: the last line" grep -qE '^RMSE [0-9.e-]+ \[' <(tail -n 1 "$TMP/err")
done
cat >"$TMP/plain.lua" <<'LUA'
local s = gr.sphere('s')
s:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))
gr.render(s, 'x.png', 200, 100, {0, 0, 5}, {0, 0, 1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({0, 0, 9}, {1, 1, 1}, {1, 0, 0})},
          {background = {0.2, 0.4, 0.1}})
LUA
expect "one colour" 0 "" -q "$TMP/plain.lua" --error 0.01 -o "$TMP/a.png" --report "$TMP/goal.csv"
is "one colour: nothing but the first samples" "$(figure samples "$TMP/goal.csv") $(figure rmse "$TMP/goal.csv")" "40000 0"
check "one colour: bounded" holds "$(figure rmse_high "$TMP/goal.csv") > 0 && $(figure rmse_high "$TMP/goal.csv") <= 0.01"
expect "standard errors" 0 "" -q "$SCENE" --variance "$TMP/v.png" -o "$TMP/a.png"
is "standard errors: a picture of 16 bits" "$(size "$TMP/v.png") $(depth "$TMP/v.png")" "64x48 16"
usage "standard errors of one sample" "--variance needs two samples at least" "$SCENE" -s 1 --variance "$TMP/v.png"
for option in --report=$TMP/none/r.json --variance=$TMP/none/r.json; do
    expect "${option%%=*}: folder missing" 4 "rt: can't write $TMP/none/r.json: No such file or directory" "$SCENE" "$option" \
        -o "$TMP/never.png"
done
is "nothing was rendered for those" "$(ls "$TMP/never.png" 2>/dev/null)" ""
expect "reports of several renders" 0 "" -q "$SCENE" -o "$TMP/m.png" --report "$TMP/m.json" --variance "$TMP/mv.png" -- 2
is "reports of several renders: files" "$(cd "$TMP" && echo m.json m-*.json mv*.png)" "m.json m-2.json mv-2.png mv.png"
"$RT" "$SCENE" -s 1 --no-audit -o "$TMP/a.png" >"$TMP/out" 2>"$TMP/err"
is "one sample without an audit" "$(tail -n 1 "$TMP/err" | cut -d' ' -f1-3)" "RMSE unknown in"
no_leftovers "error: nothing is left behind"

# ---- rt compare ----
# compares NAME STATUS LAST ARGUMENTS...: the last line of standard output must be LAST, standard error empty.
compares() {
    local name=$1 status=$2 last=$3
    shift 3
    "$RT" compare "$@" >"$TMP/out" 2>"$TMP/err"
    is "compare: $name" "$? $(cat "$TMP/err")$(tail -n 1 "$TMP/out")" "$status $last"
}
# bad_compare NAME STATUS STDERR ARGUMENTS...
bad_compare() { expect "compare: $1" "$2" "rt: $3" compare "${@:4}"; }
A=tests/data/compare/stones.png B=tests/data/compare/stones_blurred.png
ALL="differing 7680 of 7680 pixels, 100.000 %, by more than 0 levels"
compares "different" 0 "$ALL" $A $B
is "compare: figures" "$(tr '\n' ';' <"$TMP/out")" "RMSE      0.0435639;PSNR      27.217 dB;SSIM      0.852056;\
FLIP      0.14304;greatest  0.215686, 55 levels, at 41,2;$ALL;"
compares "equal" 0 "differing 0 of 7680 pixels, 0.000 %, by more than 0 levels" $A $A --max-rmse 0 --max-diff 0 --tolerance 0
is "compare: equal: figures" "$(head -n 5 "$TMP/out" | tr '\n' ';')" \
    "RMSE      0;PSNR      inf dB;SSIM      1.000000;FLIP      0;greatest  0, 0 levels;"
compares "RMSE near enough" 0 "$ALL" $A $B --max-rmse 0.0436
compares "RMSE" 1 "fails: RMSE 0.0435639 is more than 0.0435" $A $B --max-rmse 0.0435
compares "greatest difference near enough" 0 "$ALL" $A $B --max-diff .2157
compares "greatest difference" 1 "fails: the greatest difference 0.215686 is more than 0.2156" $A $B --max-diff=0.2156
compares "tolerance" 1 "fails: 1 pixel, 0.013 %, differs by more than 54 levels; 0 % may" $A --tolerance 54 $B
compares "tolerance wide enough" 0 "differing 0 of 7680 pixels, 0.000 %, by more than 55 levels" $A $B --tolerance 55
compares "share" 0 "differing 1 of 7680 pixels, 0.013 %, by more than 54 levels" $A $B --tolerance 54 --max-share 0.02
compares "edges" 1 "fails: 1 differing pixel not near an edge, the first at 41,2" $A $B --tolerance 54 --max-share 1 --edges 0
compares "crop" 0 "differing 1 of 4 pixels, 25.000 %, by more than 54 levels" $A $B --tolerance 54 --max-share 25 --crop 40,2,42,4
is "compare: crop: place" "$(grep greatest "$TMP/out")" "greatest  0.215686, 55 levels, at 1,0"
compares "linear" 0 "$ALL" $A $B --linear
is "compare: linear changes FLIP" "$(grep -c 'FLIP      0.14304' "$TMP/out") $(grep -c 'SSIM      0.852056' "$TMP/out")" "0 1"
compares "names after --" 0 "$ALL" -- $A $B
compares "quiet" 1 "" -q $A $B --tolerance 1
compares "from a pipe" 0 "$ALL" /dev/stdin $B <$A
compares "map" 0 "$ALL" $A $B --diff "$TMP/map.png"
is "compare: map: size" "$(size "$TMP/map.png")" 96x80
compares "map of what fails" 1 "fails: RMSE 0.0435639 is more than 0" $A $B --max-rmse 0 --crop 0,0,96,80 --diff "$TMP/map2.png"
check "compare: map of what fails: it is written" cmp "$TMP/map.png" "$TMP/map2.png"
bad_compare "one picture" 2 "two pictures are compared; see rt compare --help" $A
bad_compare "three pictures" 2 "two pictures are compared, not '$A' too; see rt compare --help" $A $B $A
bad_compare "sizes" 2 "$A is 96 x 80 and $TMP/whole.png is 64 x 48; see rt compare --help" $A "$TMP/whole.png"
bad_compare "crop beyond" 2 "--crop reaches beyond the pictures of 96 x 80; see rt compare --help" $A $B --crop 0,0,97,80
bad_compare "crop" 2 "--crop must be X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1, not '5,0,5,9'; see rt compare --help" $A $B --crop 5,0,5,9
for bad in -1 nan inf 1e999 x '' 1x ' 1'; do
    bad_compare "RMSE '$bad'" 2 "--max-rmse must be a number from 0, not '$bad'; see rt compare --help" $A $B --max-rmse "$bad"
    bad_compare "difference '$bad'" 2 "--max-diff must be a number from 0, not '$bad'; see rt compare --help" $A $B --max-diff "$bad"
done
for bad in -1 256 x; do
    bad_compare "tolerance '$bad'" 2 "--tolerance must be levels from 0 to 255, not '$bad'; see rt compare --help" $A $B --tolerance "$bad"
done
bad_compare "share" 2 "--max-share must be percent from 0 to 100, not '101'; see rt compare --help" $A $B --max-share 101
bad_compare "edges" 2 "--edges must be an integer from 0 to 65535, not '1.5'; see rt compare --help" $A $B --edges 1.5
bad_compare "unknown option" 2 "unknown option --tolerence (did you mean --tolerance?); see rt compare --help" $A $B --tolerence 1
bad_compare "an option of rendering" 2 "unknown option --samples; see rt compare --help" $A $B --samples 1
bad_compare "missing" 3 "can't open $TMP/none.png: No such file or directory" $A "$TMP/none.png"
bad_compare "no picture" 3 "$SCENE: neither a PNG nor a PFM" $A "$SCENE"
head -c 5000 $A >"$TMP/cut.png"
bad_compare "cut off" 3 "$TMP/cut.png: the file is cut off" "$TMP/cut.png" $B
head -c 5000 "$TMP/float.pfm" >"$TMP/cut.pfm"
bad_compare "PFM cut off" 3 "$TMP/cut.pfm: the file is cut off" "$TMP/cut.pfm" "$TMP/float.pfm"
printf 'Pf\n1 1\n-1\n\0\0\300\177' >"$TMP/nan.pfm"
bad_compare "no number" 3 "$TMP/nan.pfm: pixel 0,0 is no finite number" "$TMP/nan.pfm" "$TMP/nan.pfm"
printf 'PF\n70000 1\n-1\n' >"$TMP/wide.pfm"
bad_compare "too large" 3 "$TMP/wide.pfm: 70000 x 1 pixels; at most 65535 a side and 268435456 in all are allowed" "$TMP/wide.pfm" $B
bad_compare "map folder missing" 4 "can't write $TMP/none/m.png: No such file or directory" $A $B --diff "$TMP/none/m.png"
bad_compare "map: disk full" 4 "can't write /dev/full: No space left on device" -q $A $B --diff /dev/full
"$RT" compare $A $B >/dev/full 2>"$TMP/err"
is "compare: standard output full" "$? $(cat "$TMP/err")" "4 rt: can't write to standard output: No space left on device"
"$RT" compare --help >"$TMP/out" 2>"$TMP/err"
is "compare: help" "$? $(cat "$TMP/err")$(head -n 1 "$TMP/out")" "0 Usage: rt compare [options] A B"
is "compare: help fits 80 columns" "$(awk 'length > 80' "$TMP/out")" ""
for option in --crop --linear --max-rmse --max-diff --tolerance --max-share --edges --diff -q --help; do
    grep -qE -- "(^| )$option\b" "$TMP/out" || not_ok "compare: help: $option" "is not in it"
done

# ---- what is printed ----
"$RT" "$SCENE" -t 2 -o "$TMP/a.png" >"$TMP/out" 2>"$TMP/err"
is "summary: standard output" "$(cat "$TMP/out")" ""
is "summary" "$(sed -E 's/[0-9.]+( [kMG])? rays in [0-9.]+ s \(CPU [0-9.]+ s\)/N rays in T s (CPU T s)/; 2d' "$TMP/err")" \
    "$TMP/a.png: 64 x 48, 9 samples, N rays in T s (CPU T s), 2 threads"
is "summary: error" "$(sed -E '1d; s/0\.[0-9]+/E/g; s/E s/T s/g; s/[0-9]+\.[0-9] s/T s/g' "$TMP/err")" \
    "RMSE E [E, E] in T s (CPU T s); E would take about T s"
echo "print('hello') io.write('you\n') gr.sphere('s', 1, 2)" >"$TMP/print.lua"
"$RT" "$TMP/print.lua" >"$TMP/out" 2>"$TMP/err"
is "the script's words" "$? $(tr '\n' ' ' <"$TMP/out")" "0 hello you "
is "warnings" "$(cat "$TMP/err")" "$TMP/print.lua:1: warning: gr.sphere: 2 surplus arguments ignored
rt: warning: $TMP/print.lua never calls gr.render: there is no picture"
cat >"$TMP/flat.lua" <<'LUA'
local m = gr.mesh('m', {{0,0,0}, {1,0,0}, {0,1,0}, {2,0,0}}, {{0,1,2}, {0,1,3}})
m:set_material(gr.material({1,1,1}, {0,0,0}, 1))
for i = 1, 2 do m:render('flat.png', 8, 8, {0,0,5}, {0,0,-1}, {0,1,0}, 50, {1,1,1}, {gr.light({0,0,9}, {1,1,1}, {1,0,0})}) end
LUA
expect "degenerate triangles: one warning" 0 "$TMP/flat.lua:1: warning: mesh 'm': 1 degenerate triangle left out" \
    --check "$TMP/flat.lua"
sed "s/{{0,0,0}, {1,0,0}, {0,1,0}, {2,0,0}}, {{0,1,2}, {0,1,3}}/{{1e15,0,0}, {1e15+1,0,0}, {1e15,1,0}}, {{0,1,2}}/" \
    "$TMP/flat.lua" >"$TMP/coarse.lua"
expect "coordinates too coarse for the picture: one warning" 0 "$TMP/coarse.lua:1: warning: mesh 'm' is 1 across, but numbers \
as great as its coordinates, 1e+15, are 0.12 apart: it is drawn that coarsely" --check "$TMP/coarse.lua"
if command -v script >/dev/null; then
    script -qec "$RT $SCENE --size 600x600 -s 16 -o $TMP/a.png" /dev/null >"$TMP/tty" 2>&1 </dev/null
    is "a terminal gets a progress bar" "$(grep -c '\[#* *\] .* %' "$TMP/tty")" 1
    is "a terminal: the bar is erased" "$(tr -d '\n' <"$TMP/tty" | sed -E 's/.*\r\x1b\[K//; s/: .*//')" "$TMP/a.png"
    is "quiet on a terminal" "$(script -qec "$RT -q $SCENE -o $TMP/a.png" /dev/null </dev/null)" ""
else
    skip "progress bar" "no script(1)"
fi

# ---- statistics ----
"$RT" -q "$SCENE" -o "$TMP/a.png" --stats "$TMP/s.json" -- 2
is "statistics: status" $? 0
cat >"$TMP/json.lua" <<'LUA'
-- Reads JSON by turning it into Lua, strictly enough for what rt writes.
local text = io.open(arg[1]):read('a')
local lua = text:gsub('"([%w_]+)":', '["%1"]='):gsub('%[\n', '{\n'):gsub('\n  %]', '\n  }'):gsub('null', 'nil')
local stats = assert(load('return ' .. lua))()
assert(#stats.renders == 2)
for _, r in ipairs(stats.renders) do
  for _, stage in ipairs {'script', 'load', 'compile', 'bvh', 'render', 'encode'} do
    assert(r.stages[stage].wall_s >= 0 and r.stages[stage].cpu_s >= 0, stage)
  end
  assert(r.rays.camera == 64 * 48 * 9 and r.rays.shadow > 0 and r.rays.mirror > 0)
  assert(r.meshes.named == 0 and r.textures.loaded == 0 and r.nodes == 3 and r.triangles == 0)
  assert(r.width == 64 and r.height == 48 and r.samples == 9 and r.peak_memory_bytes > 1e6)
end
LUA
check "statistics: contents" lua5.4 "$TMP/json.lua" "$TMP/s.json"
if command -v python3 >/dev/null; then check "statistics: valid JSON" python3 -m json.tool "$TMP/s.json" /dev/null; fi
echo old >"$TMP/s.json"
"$RT" -q tests/bad/nan.lua --stats "$TMP/s.json" 2>/dev/null
is "statistics: a failure leaves the old ones" "$(cat "$TMP/s.json")" old

# ---- scenes of the course and of the oracle ----
mkdir -p "$TMP/lib" "$TMP/scenes"
echo "function material() return gr.material({1, 1, 1}, {0, 0, 0}, 0) end" >"$TMP/lib/shared.lua"
cat >"$TMP/scenes/uses.lua" <<'LUA'
require('shared')
local s = gr.sphere('s')
s:set_material(material())
gr.render(s, 'x.png', 4, 4, {0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({0, 0, 9}, {1, 1, 1}, {1, 0, 0})})
LUA
expect "without -I" 3 "$TMP/scenes/uses.lua:1: can't find the module 'shared' as shared.lua" --check "$TMP/scenes/uses.lua"
expect "-I" 0 "" --check -I "$TMP/none" -I "$TMP/lib" "$TMP/scenes/uses.lua"
cat >"$TMP/lib/matte.lua" <<'LUA'
local material, render = gr.material, gr.render
gr.material = function(kd) return material(kd, {0, 0, 0}, 1) end
gr.reflective_material = gr.material
gr.render = function(root, file, w, h, eye, view, up, fov, ambient, lights, options)
  options = options or {}
  options.background = {0, 0, 0}
  return render(root, file, w, h, eye, view, up, fov, ambient, lights, options)
end
dofile(arg[1])
LUA
expect "a script around a scene" 0 "" -q -s 1 -I "$TMP/scenes" -o "$TMP/matte.png" "$TMP/lib/matte.lua" -- uses.lua
is "a script around a scene: picture" "$(size "$TMP/matte.png")" 4x4
expect "a script of 2015" 0 "" --legacy --check tests/legacy/snowman.lua
"$RT" --check tests/legacy/snowman.lua 2>"$TMP/err"
is "a script of 2015 without --legacy" "$? $(cat "$TMP/err")" \
    "1 tests/legacy/snowman.lua:5: attempt to call a nil value (field 'getn')"
"$RT" -q --legacy tests/legacy/snowman.lua -o "$TMP/legacy.png" && "$RT" -q tests/legacy/snowman_today.lua -o "$TMP/today.png"
check "post-multiplied transforms" cmp "$TMP/legacy.png" "$TMP/today.png"

# ---- signals: also when this shell has been told to ignore them ----
if env --default-signal=INT true 2>/dev/null; then
    for signal in INT:130 TERM:143; do
        env --default-signal timeout --preserve-status -s "${signal%:*}" 0.5 "$RT" -q "$SCENE" --size 4000x4000 -s 400 -o "$TMP/old.png"
        is "SIG${signal%:*}" $? "${signal#*:}"
    done
    is "signals: the old file stays" "$(cat "$TMP/old.png")" old
    no_leftovers "signals: nothing is left behind"
else
    skip signals "env can't reset them"
fi
finish
