# For benchmarks of whole runs, sourced from the project's root with `out`, a folder for files, set: timing, and POV-Ray on
# the same scenes. Its scenes are written by ../shared/oracle.
root=$PWD rt=$(realpath "${RT:-./rt}") oracle=$(realpath -m ../shared/oracle) threads=$(nproc)
mkdir -p $out
povray=
[ -e "$oracle/gr2pov.lua" ] && command -v povray lua5.4 >/dev/null && povray=1
[ -n "$povray" ] || echo "Without POV-Ray: it needs $oracle, povray and lua5.4"

# timed COMMAND...: runs it quietly, sets wall and cpu.
timed() {
    local TIMEFORMAT='%R %U %S' times user system
    times=$( { time "$@" >$out/log 2>&1; } 2>&1) || { tail -n 3 $out/log >&2; return 1; }
    read -r wall user system <<<"$times"
    cpu=$(awk "BEGIN { print $user + $system }")
}

median() { printf '%s\n' "$@" | sort -g | awk '{ x[NR] = $1 } END { printf "%.3f", (x[int((NR + 1) / 2)] + x[int(NR / 2) + 1]) / 2 }'; }

# write_pov SCENE FILE.pov SIZE [matte]
write_pov() {
    (cd "$(dirname "$1")" && LUA_PATH="?.lua;../final/?.lua;;" lua5.4 "$oracle/gr2pov.lua" "$(basename "$1")" "$root/$2" $4 $3 $3 >/dev/null 2>&1)
}

# run_povray FILE.pov SIZE THREADS OPTION...: draws $out/povray.png.
run_povray() {
    local file=$1 size=$2 count=$3
    shift 3
    povray -D +WT$count "+I$file" "+O$out/povray.png" +W$size +H$size "$@" File_Gamma=1.0
}

# agreement SCENE SIZE: sets it to "agrees" or to why POV-Ray has no time. As tests/test_povray.sh does, matte and one
# sample at the pixel's centre. Leaves $out/scene.pov.
agreement() {
    agreement="not run"
    [ -n "$povray" ] || return
    agreement="not expressed"
    write_pov "$1" $out/matte.pov $2 matte && write_pov "$1" $out/scene.pov $2 || return
    agreement="differs"
    run_povray $out/matte.pov $2 $threads -A >$out/log 2>&1 || return
    (cd "$(dirname "$1")" && "$rt" -q -I . -o "$root/$out/rt.png" -s 1 --size ${2}x$2 "$oracle/matte.lua" -- "$(basename "$1")") >$out/log 2>&1 || return
    "$rt" compare --tolerance 3 --max-share 0.5 --edges 2 $out/rt.png $out/povray.png >$out/log && agreement="agrees"
}
