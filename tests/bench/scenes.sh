#!/usr/bin/env bash
# Seconds of whole runs, script to PNG, by the clock and of processor time, at 9 samples, beside POV-Ray 3.7 where it can express the scene:
#   scenes     each scene of Assets that has its picture beside it, 512 x 512, all threads
#   triangles  a landscape of 10 thousand to 10 million triangles (POV-Ray to 1 million: it needs minutes to read more)
#   pixels     one scene from 128 x 128 to 2048 x 2048
#   threads    the same at 1024 x 1024 with 1, 2, 4, ... threads
# tests/bench/scenes.sh [PART...]; REPEAT=3 turns, the median of which counts. A table to standard output, build/bench-scenes.csv
# and, when all parts have run, build/bench-scenes.svg.
#
# Pictures are compared first: POV-Ray has no time where they differ. It takes its 9 samples of a pixel (+AM1 +R3) of every
# one (+A0.0), and the ray by which it decides to on top of them.
cd "$(dirname "$0")/../.." || exit 1
repeat=${REPEAT:-3} out=build/bench csv=build/bench-scenes.csv pixel_scene=Assets/csg/csg_complex.lua
. tests/bench/runs.sh
parts=("$@")
[ $# -gt 0 ] || parts=(scenes triangles pixels threads)

# stage NAME: its wall seconds in rt's last run.
stage() { sed -n "s/.*\"$1\": {\"wall_s\": \([0-9.]*\),.*/\1/p" $out/stats.json | head -n 1; }

# measure PART SCENE SIZE THREADS: one row. Expects agreement to be set.
measure() {
    local ours=() theirs=() ours_cpu=() theirs_cpu=() ratio= ratio_cpu= i
    for ((i = 0; i < repeat; i++)); do
        timed "$rt" -q -t $4 -s 9 --size ${3}x$3 --stats $out/stats.json -o $out/rt.png "$2" || { echo "$2 doesn't render" >&2; exit 1; }
        ours+=($wall) ours_cpu+=($cpu)
        [ "$agreement" = agrees ] || continue
        timed run_povray $out/scene.pov $3 $4 +A0.0 +AM1 +R3 -J || { echo "POV-Ray fails on $2" >&2; exit 1; }
        theirs+=($wall) theirs_cpu+=($cpu)
    done
    local triangles name=${2#Assets/}
    name=${name%.lua} name=${name#build/bench/*/}
    triangles=$(sed -n 's/.*"triangles": \([0-9]*\).*/\1/p' $out/stats.json | head -n 1)
    local our_wall our_cpu their_wall= their_cpu=
    our_wall=$(median "${ours[@]}") our_cpu=$(median "${ours_cpu[@]}")
    if [ ${#theirs[@]} -gt 0 ]; then
        their_wall=$(median "${theirs[@]}") their_cpu=$(median "${theirs_cpu[@]}")
        ratio=$(awk "BEGIN { printf \"%.2f\", $their_wall / $our_wall }")
        ratio_cpu=$(awk "BEGIN { printf \"%.2f\", $their_cpu / $our_cpu }")
    fi
    echo "$1,$name,$triangles,$3,$4,$our_wall,$our_cpu,$(stage load),$(stage bvh),$(stage render),$their_wall,$their_cpu,$ratio,$ratio_cpu,$agreement" >>$csv
    printf '%-9s %-32s %8s %4s %3s %8s %8s %8s %8s %6s %6s  %s\n' "$1" "$name" "$triangles" "$3" "$4" "$our_wall" \
        "$our_cpu" "${their_wall:--}" "${their_cpu:--}" "${ratio:--}" "${ratio_cpu:--}" "$agreement"
}

part_scenes() {
    local scene
    for scene in Assets/*/*.lua; do
        [ -e "${scene%.lua}.png" ] || continue
        agreement "$scene" 512
        measure scenes "$scene" 512 $threads
    done
}

part_triangles() {
    local count folder=$out/terrain
    mkdir -p $folder
    for count in 10000 30000 100000 300000 1000000 3000000 10000000; do
        lua5.4 tests/bench/terrain.lua $count $folder || exit
        agreement="too large"
        [ $count -gt 1000000 ] || agreement $folder/terrain.lua 512
        measure triangles $folder/terrain.lua 512 $threads
    done
    rm -r $folder
}

part_pixels() {
    local size
    for size in 128 256 512 1024 2048; do
        agreement $pixel_scene $size
        measure pixels $pixel_scene $size $threads
    done
}

part_threads() {
    local count
    agreement $pixel_scene 1024
    for ((count = 1; count < 2 * threads; count *= 2)); do
        measure threads $pixel_scene 1024 $((count < threads ? count : threads))
    done
}

echo "part,scene,triangles,size,threads,rt_wall_s,rt_cpu_s,rt_load_s,rt_bvh_s,rt_render_s,povray_wall_s,povray_cpu_s,ratio,ratio_cpu,povray" >$csv
printf '%-9s %-32s %8s %4s %3s %8s %8s %8s %8s %6s %6s  %s\n' part scene triangle size thr "rt wall" "rt cpu" "POV wall" "POV cpu" \
    POV/rt "of cpu" POV-Ray
for part in "${parts[@]}"; do part_$part; done
echo "The table is also $csv"
if [ $# = 0 ]; then
    gnuplot tests/bench/scenes.gnuplot && echo "The plot is build/bench-scenes.svg"
fi
