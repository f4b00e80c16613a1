# build/error-time.csv as pictures: RMSE against wall seconds, a panel for each scene, and the rods alone.
if (!exists("kind")) kind = "svg"
csv = "build/error-time.csv"
set datafile separator ","
fixed = "#117733"
adaptive = "#1b6ca8"
method_1 = "#d95f02"
method_2 = "#a6336c"
floor_error = 1 / (255 * sqrt(12))
names = system("cut -d, -f1 " . csv . " | tail -n +2 | uniq")
count = words(names)
# The rows of a curve in order of time, so that lines join neighbours; without those whose error is known to no better than
# 10 %.
known = "awk -F, '$7 < 0.1 * $6'"
rows(scene, program) = sprintf("< grep '^%s,%s,' %s | %s | sort -t, -g -k4,4", scene, program, csv, known)

has(scene, program) = system(sprintf("grep -c '^%s,%s,' %s", scene, program, csv)) > 0
least(scene) = system(sprintf("grep '^%s,' %s | %s | cut -d, -f4 | sort -g | head -n 1", scene, csv, known)) * 0.7
most(scene) = system(sprintf("grep '^%s,' %s | %s | cut -d, -f4 | sort -g | tail -n 1", scene, csv, known)) * 1.4

set logscale xy
set format "10^{%L}"
set grid lc rgb "#dddddd"
# Line styles don't outlive a reset, macros do.
set macros
S1 = "lc rgb fixed lw 1.5 pt 7"
S2 = "lc rgb adaptive lw 1.5 pt 5"
S3 = "lc rgb method_1 lw 1.5 pt 9"
S4 = "lc rgb method_2 lw 1.5 pt 11"
S5 = "lc rgb '#888888' lw 1 dt 2"

columns = 5
lines = int(ceil((count + 1.0) / columns))
set terminal kind size 1400,250 * lines + 60 font "sans,11" background "white"
set output "build/error-time." . kind
set multiplot layout lines,columns title "RMSE in linear light against wall seconds of whole runs; dashed: what rounding to 8 bits adds" font ",14"
set tmargin 2
set bmargin 2
set lmargin 6
set rmargin 1
unset key
do for [scene in names] {
    set title scene noenhanced font ",11" offset 0,-0.6
    set xrange [least(scene):most(scene)]
    if (has(scene, "povray-1")) {
        plot floor_error @S5, rows(scene, "fixed") using 4:6 with linespoints @S1 ps 0.55, \
             rows(scene, "adaptive") using 4:6 with linespoints @S2 ps 0.55, \
             rows(scene, "povray-1") using 4:6 with points @S3 ps 0.65, rows(scene, "povray-2") using 4:6 with points @S4 ps 0.65
    } else {
        plot floor_error @S5, rows(scene, "fixed") using 4:6 with linespoints @S1 ps 0.55, \
             rows(scene, "adaptive") using 4:6 with linespoints @S2 ps 0.55
    }
}
# The legend has the last place.
unset title
unset border
unset tics
unset grid
set xrange [1:2]
set yrange [1:2]
set key center center Left reverse samplen 2 spacing 1.4 font ",12"
plot NaN with linespoints @S1 title "rt, fixed samples (-s)", NaN with linespoints @S2 title "rt, error goals (--error)", \
     NaN with points @S3 title "POV-Ray 3.7, method 1", NaN with points @S4 title "POV-Ray 3.7, method 2"
unset multiplot

rods = "rods/rods"
if (has(rods, "fixed")) {
    reset
    set datafile separator ","
    set terminal kind size 760,480 font "sans,12" background "white"
    set output "build/error-time-rods." . kind
    set logscale xy
    set grid lc rgb "#dddddd"
    set title "Rods thinner than a pixel: error against run time"
    set xlabel "wall seconds, start to picture"
    set ylabel "RMSE, linear light"
    set xrange [least(rods):most(rods)]
    set key top right opaque Left reverse samplen 2
    set label 1 "8-bit rounding" at graph 0.02, first floor_error * 1.15 textcolor rgb "#666666"
    plot floor_error @S5 notitle, \
         rows(rods, "fixed") using 4:6 with linespoints @S1 ps 0.9 title "rt, fixed samples (-s)", \
         rows(rods, "adaptive") using 4:6 with linespoints @S2 ps 0.9 title "rt, error goals (--error)", \
         rows(rods, "povray-1") using 4:6 with points @S3 ps 1.1 title "POV-Ray 3.7, method 1", \
         rows(rods, "povray-2") using 4:6 with points @S4 ps 1.1 title "POV-Ray 3.7, method 2"
}
