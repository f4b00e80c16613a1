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
# The rows of a curve in order of time, so that lines join neighbours.
rows(scene, program) = sprintf("< grep '^%s,%s,' %s | sort -t, -g -k4,4", scene, program, csv)

set logscale xy
set format y "10^{%L}"
set format x "10^{%L}"
set grid lc rgb "#dddddd"
set style line 1 lc rgb fixed lw 1.5 pt 7 ps 0.55
set style line 2 lc rgb adaptive lw 1.5 pt 5 ps 0.55
set style line 3 lc rgb method_1 lw 1.5 pt 9 ps 0.65
set style line 4 lc rgb method_2 lw 1.5 pt 11 ps 0.65
set style line 5 lc rgb "#888888" lw 1 dt 2
has(scene, program) = system(sprintf("grep -c '^%s,%s,' %s", scene, program, csv)) > 0

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
    if (has(scene, "povray-1")) {
        plot floor_error ls 5, rows(scene, "fixed") using 4:6 with linespoints ls 1, rows(scene, "adaptive") using 4:6 with linespoints ls 2, \
             rows(scene, "povray-1") using 4:6 with points ls 3, rows(scene, "povray-2") using 4:6 with points ls 4
    } else {
        plot floor_error ls 5, rows(scene, "fixed") using 4:6 with linespoints ls 1, rows(scene, "adaptive") using 4:6 with linespoints ls 2
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
plot NaN with linespoints ls 1 title "rt, fixed samples (-s)", NaN with linespoints ls 2 title "rt, error goals (--error)", \
     NaN with points ls 3 title "POV-Ray 3.7, method 1", NaN with points ls 4 title "POV-Ray 3.7, method 2"
unset multiplot

rods = "rods-rods"
if (count > 0 && has(rods, "fixed")) {
    reset
    set datafile separator ","
    set terminal kind size 760,480 font "sans,12" background "white"
    set output "build/error-time-rods." . kind
    set logscale xy
    set grid lc rgb "#dddddd"
    set title "Rods thinner than a pixel: error against run time"
    set xlabel "wall seconds, start to picture"
    set ylabel "RMSE, linear light"
    set key top right opaque Left reverse samplen 2
    set label 1 "8-bit rounding" at graph 0.02, first floor_error * 1.15 textcolor rgb "#888888"
    plot floor_error ls 5 notitle, \
         rows(rods, "fixed") using 4:6 with linespoints ls 1 ps 0.9 title "rt, fixed samples (-s)", \
         rows(rods, "adaptive") using 4:6 with linespoints ls 2 ps 0.9 title "rt, error goals (--error)", \
         rows(rods, "povray-1") using 4:6 with points ls 3 ps 1.1 title "POV-Ray 3.7, method 1", \
         rows(rods, "povray-2") using 4:6 with points ls 4 ps 1.1 title "POV-Ray 3.7, method 2"
}
