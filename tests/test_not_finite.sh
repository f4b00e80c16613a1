#!/usr/bin/env bash
# No number that isn't finite, and none out of its range, enters a scene: every argument, file and option that takes numbers
# is given such ones, by exit status and message. What arises while rendering is counted, told and drawn again.
cd "$(dirname "$0")/.." && . tests/support/shell.sh

# ---- arguments: tests/data/arguments.txt has what goes before, the calls and what is wrong for which kind of them ----
awk -v n=1 '/^---$/ { n++; next } { print > (dir "/part" n) }' dir="$TMP" tests/data/arguments.txt
line=$(($(wc -l <"$TMP/part1") + 1))
mapfile -t calls <"$TMP/part2"
bad_values() {  # of a kind
    printf '%s\n' 0/0 1/0 -1/0
    case $1 in
    number | positive | least0 | not0 | share | angle) awk '$1 == "number" { print $2 }' "$TMP/part3" ;;
    esac
    [ "$1" = number ] || awk -v kind="$1" '$1 == kind { print $2 }' "$TMP/part3"
}
tried=0
for call in "${calls[@]}"; do
    kind=${call%% *} statement=${call#* }
    command=$(sed -E 's/^(gr\.[a-z_]+|[a-z]+:[a-z_]+).*/\1/; s/^[a-z]+:/node:/' <<<"$statement")
    while read -r value; do
        { cat "$TMP/part1"; printf '%s\n' "${statement/@/"$value"}"; } >"$TMP/bad.lua"
        "$RT" -q "$TMP/bad.lua" -o "$TMP/bad.png" >"$TMP/out" 2>"$TMP/err"
        got="$? $(cat "$TMP/err")"
        tried=$((tried + 1))
        [[ "$got" == "1 $TMP/bad.lua:$line: $command: "* && "$(wc -l <"$TMP/err")" == 1 && ! -s "$TMP/out" ]] ||
            not_ok "${statement/@/"$value"}" "$got"
    done < <(bad_values "$kind")
    # The call is right but for that value.
    if [[ $statement != *none.grammar* ]]; then
        { cat "$TMP/part1"; printf '%s\n' "${statement/@/1}"; } >"$TMP/good.lua"
        got=$("$RT" -q "$TMP/good.lua" -o "$TMP/good.png" 2>&1)
        status=$?
        [ "$status ${got##rt: warning: $TMP/good.lua never calls gr.render*}" = "0 " ] || not_ok "${statement/@/1}" "$status $got"
    fi
done
if [ $failures = 0 ] && [ $tried -ge 400 ]; then ok "$tried bad arguments"; else not_ok "bad arguments" "$tried tried"; fi
[ -e "$TMP/bad.png" ] && not_ok "bad arguments" "there is a picture"

# ---- numbers that are finite one by one, but not together ----
# scene NAME STATUS TEXT LINES...: renders the node `top`.
scene() {
    local name=$1 status=$2 text=$3 got
    shift 3
    { printf '%s\n' "$@"; echo "gr.render(top, 'o.png', 9, 9, eye or {0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 40, {0.2, 0.2, 0.2}, lights or {gr.light({3, 4, 5}, {0.5, 0.5, 0.5}, {1, 0, 0})})"; } >"$TMP/scene.lua"
    "$RT" -q -s 1 "$TMP/scene.lua" -o "$TMP/scene.png" --stats "$TMP/scene.json" >"$TMP/out" 2>"$TMP/err"
    got=$?
    if [ $got != "$status" ] || [ "$(cat "$TMP/err")" != "${text:+$TMP/scene.lua:$text}" ]; then
        not_ok "$name" "$got $(cat "$TMP/err")"
    elif [ "$status" = 0 ] && ! grep -q '"samples_not_finite": 0,' "$TMP/scene.json"; then
        not_ok "$name" "$(grep not_finite "$TMP/scene.json")"
    else ok "$name"; fi
}
ball="local top, s = gr.node('top'), gr.sphere('s') s:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)) top:add_child(s)"
scene "scales whose product overflows" 1 "1: sphere 's' reaches beyond the range of numbers" "$ball" "s:scale(1e200, 1e200, 1e200) top:scale(1e200, 1e200, 1e200)"
scene "scales whose product vanishes" 1 "1: sphere 's' has a singular matrix, or one too extreme to be inverted" "$ball" "s:scale(1e-150, 1e-150, 1e-150) top:scale(1e-200, 1e-200, 1e-200)"
scene "translations whose sum overflows" 1 "1: sphere 's' reaches beyond the range of numbers" "$ball" "s:translate(1.5e308, 0, 0) top:translate(1.5e308, 0, 0)"
scene "a mesh whose scale overflows" 1 "1: mesh 'm' reaches beyond the range of numbers" \
    "local top, m = gr.node('top'), gr.mesh('m', {{0, 0, 0}, {1e200, 0, 0}, {0, 1e200, 0}}, {{0, 1, 2}}) top:add_child(m)" \
    "m:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)) m:scale(1e150, 1e150, 1e150)"
printf 'F\ntrunk F 1e200 1e200 1e200\n' >"$TMP/huge.grammar"
scene "a tree that overflows" 1 "1: sphere 's' reaches beyond the range of numbers" "$ball" "s:scale(1e200, 1e200, 1e200)" "top = gr.tree('t', 'huge.grammar', 1, s, s)"
scene "a light 1e200 away" 0 "" "$ball" "lights = {gr.light({0, 1e200, 1e200}, {0.5, 0.5, 0.5}, {1, 0, 0})}"
scene "a light 1e308 away from a scene of 1e-290" 0 "" "$ball" "s:scale(1e-290, 1e-290, 1e-290) eye = {0, 0, 3e-290}" "lights = {gr.light({1e308, -1e308, 1e308}, {1, 1, 1}, {0, 1e-300, 1e-300})}"
scene "a falloff of almost nothing" 0 "" "$ball" "lights = {gr.light({0, 0, 3}, {1, 1, 1}, {1e-300, 0, 0})}"
scene "a falloff that crosses 0" 0 "" "$ball" "lights = {gr.light({0, 0, 3}, {1, 1, 1}, {-2, 1, 0})}"

# ---- files ----
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n' >"$TMP/good.obj"
printf 'F\ntrunk F 1 1 1\nbranch ( ) 0 0 10\nF 0.5 F F\n' >"$TMP/good.grammar"
cat >"$TMP/obj.lua" <<'LUA'
local m = gr.mesh('m', 'file.obj')
m:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))
gr.render(m, 'o.png', 4, 4, {0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 40, {1, 1, 1}, {gr.light({0, 0, 9}, {1, 1, 1}, {1, 0, 0})})
LUA
cat >"$TMP/grammar.lua" <<'LUA'
local s = gr.sphere('s')
s:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))
local t = gr.tree('t', 'file.grammar', 2, s, s)
gr.render(t, 'o.png', 4, 4, {0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 40, {1, 1, 1}, {gr.light({0, 0, 9}, {1, 1, 1}, {1, 0, 0})})
LUA
# file KIND LINE FROM: the number FROM in that line of good.KIND is replaced by each bad one.
file() {
    local value
    for value in nan inf -inf NAN Infinity 1e999 -1e999 0x1p3 nan\(1\) 1e; do
        sed "$2s/$3/$value/" "$TMP/good.$1" >"$TMP/file.$1"
        "$RT" -q "$TMP/$1.lua" -o "$TMP/file.png" >"$TMP/out" 2>"$TMP/err"
        got="$? $(cat "$TMP/err")"
        [[ "$got" == "3 $TMP/file.$1:$2: '$value' is not a"*number && ! -s "$TMP/out" ]] || { not_ok "$1, line $2: $value" "$got"; return; }
    done
    ok "$1, line $2: no number that isn't finite"
}
for line in 2 4 5; do file obj $line '[01]'; done
for line in 2 3 4; do file grammar $line '[01][.0-9]*'; done
for kind in obj grammar; do
    cp "$TMP/good.$kind" "$TMP/file.$kind"
    check "$kind: right but for those" "$RT" -q "$TMP/$kind.lua" -o "$TMP/file.png"
done
sed 's/vt 0 0/vt 1e300 -1e300/; s/vn 0 0 1/vn 1e300 -1e-300 1e300/' "$TMP/good.obj" >"$TMP/file.obj"
is() { if [ "$2" = "$3" ]; then ok "$1"; else not_ok "$1" "'$2' and not '$3'"; fi; }
is "obj: huge coordinates and normals" "$("$RT" -q "$TMP/obj.lua" -o "$TMP/file.png" 2>&1)" ""

# ---- options ----
for option in "-s nan" "-s inf" "-t nan" "--max-depth inf" "--seed nan" "--size nanx4" "--size 4xinf" "--crop 0,0,nan,4" \
    "--background nan,0,0" "--background 0,inf,0" "--background 0,0,-inf" "--background 0,0,1e999"; do
    "$RT" $option "$TMP/good.lua" >"$TMP/out" 2>"$TMP/err"
    is "option $option" "$? $(grep -c "^rt: ${option%% *} must be " "$TMP/err")" "2 1"
done

# ---- what arises while rendering: kd, a light and its falloff within float's range, their product beyond ----
cat >"$TMP/bright.lua" <<'LUA'
local s, t, root = gr.sphere('s'), gr.sphere('t'), gr.node('root')
s:set_material(gr.material({0.5, 0.5, 0.5}, {0, 0, 0}, 1))
t:set_material(gr.material({1e38, 0.5, 0.5}, {0, 0, 0}, 1))
t:scale(0.3, 0.3, 0.3)
t:translate(1.5, 0, 0)
root:add_child(s)
root:add_child(t)
for i = 1, 2 do
  gr.render(root, 'o.png', 40 * i, 30 * i, {0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 40, {0.2, 0.2, 0.2}, {gr.light({3, 4, 5}, {100, 100, 100}, {1, 0, 0})},
            {samples = 5, seed = 3, max_depth = 2})
end
LUA
"$RT" -q "$TMP/bright.lua" -o "$TMP/bright.png" --stats "$TMP/bright.json" 2>"$TMP/err"
is "no number: status" $? 0
is "no number: a line for each picture" "$(grep -cE "^$TMP/bright.lua:9: warning: [0-9]+ samples gave no finite colour, the first sample [0-4] of pixel [0-9]+,[0-9]+; --size [0-9x]+ -s 5 --seed 3 --max-depth 2 --crop [0-9,]+ draws it alone$" "$TMP/err") $(wc -l <"$TMP/err")" "2 2"
is "no number: the statistics count them" "$(grep -o '"samples_not_finite": [0-9]*' "$TMP/bright.json" | grep -o '[0-9]*' | tr '\n' ' ')" \
    "$(sed -E 's/.*warning: ([0-9]+) samples.*/\1/' "$TMP/err" | tr '\n' ' ')"
# The options draw that pixel alone, and its first sample without a number is the same.
while read -r told; do
    options=$(sed -E 's/.*; (--size .*) draws it alone/\1/' <<<"$told")
    "$RT" -q "$TMP/bright.lua" $options -o "$TMP/alone.png" --stats "$TMP/alone.json" 2>"$TMP/alone"
    is "no number: drawn again with $options" "$(sed -E 's/.* the first/the first/' "$TMP/alone" | sort -u)" "$(sed -E 's/.* the first/the first/' <<<"$told")"
    is "no number: one pixel" "$(grep -c '"samples_taken": 5,' "$TMP/alone.json")" 2
done <"$TMP/err"

# ---- the scenes of this project: each sample is a number ----
count=0
while read -r scene; do
    [ -e "${scene%.lua}.png" ] || continue
    "$RT" -q "$scene" --size 48x36 -s 2 -o "$TMP/asset.png" --stats "$TMP/asset.json" 2>"$TMP/err" ||
        { not_ok "$scene" "$(head -n 1 "$TMP/err")"; continue; }
    count=$((count + $(grep -c '"samples_not_finite": 0,' "$TMP/asset.json")))
    ! grep '"samples_not_finite": [1-9]' "$TMP/asset.json" >"$TMP/out" || not_ok "$scene" "$(head -n 1 "$TMP/out")"
done < <(find Assets -name '*.lua' | sort)
if [ $count -ge 20 ]; then ok "each sample of $count scenes is a number"; else not_ok "scenes" "only $count"; fi
finish
