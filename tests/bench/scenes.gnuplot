# build/bench-scenes.csv as a picture: wall seconds of rt and POV-Ray for the scenes, and against triangles, pixels and
# threads.
if (!exists("kind")) kind = "svg"
set terminal kind size 1200,1100 font "sans,12" background "white"
set output "build/bench-scenes." . kind
set datafile separator ","
csv = "build/bench-scenes.csv"
ours = "#117733"
theirs = "#d95f02"
load = "#1b6ca8"
from(part, value) = strcol(1) eq part ? value : NaN

scenes = system("grep -c ^scenes, " . csv)

set grid lc rgb "#cccccc"
set logscale y
set ylabel "seconds"
set multiplot title "Whole runs, script to PNG, 9 samples a pixel"

set origin 0,0.42
set size 1,0.55
set title "Scenes of Assets, 512 x 512"
set xtics rotate by -40 left noenhanced
set bmargin 11
set rmargin 10
set xrange [-0.6:scenes - 0.4]
set key top right opaque Left reverse samplen 2
# Their rows are the file's first.
plot csv every ::1::scenes using 0:6:xtic(2) with points pt 7 ps 1.2 lc rgb ours title "rt", \
     csv every ::1::scenes using 0:11 with points pt 5 ps 1.1 lc rgb theirs title "POV-Ray, where its picture is the same"

unset rmargin
unset bmargin
unset xrange
set xtics norotate autojustify enhanced
set key top left Left reverse samplen 2
set yrange [0.001:1000]
set size 0.34,0.39
set origin 0,0
set title "A landscape, 512 x 512"
set xlabel "triangles"
set logscale xy
set format x "10^{%L}"
plot csv using (from("triangles", $3)):6 with linespoints pt 7 lc rgb ours title "rt", \
     csv using (from("triangles", $3)):8 with linespoints pt 6 lc rgb load title "rt: reading the file", \
     csv using (from("triangles", $3)):11 with linespoints pt 5 lc rgb theirs title "POV-Ray"

set key bottom right
set yrange [*:*]
set origin 0.34,0
set title "csg\\_complex"
set xlabel "pixels"
plot csv using (from("pixels", $4 * $4)):6 with linespoints pt 7 lc rgb ours title "rt", \
     csv using (from("pixels", $4 * $4)):11 with linespoints pt 5 lc rgb theirs title "POV-Ray"

set origin 0.67,0
set title "csg\\_complex, 1024 x 1024"
set xlabel "threads"
set logscale x 2
set key bottom left
set format x "%g"
plot csv using (from("threads", $5)):6 with linespoints pt 7 lc rgb ours title "rt", \
     csv using (from("threads", $5)):11 with linespoints pt 5 lc rgb theirs title "POV-Ray"
unset multiplot
