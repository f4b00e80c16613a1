# build/precision.csv as a picture: what a ray costs against the median and the worst error of t, a column for each
# primitive and solver; the letter at a point is its set of rays.
if (!exists("kind")) kind = "svg"
set terminal kind size 1600,1500 font "sans,12" background "white"
set output "build/precision." . kind
set datafile separator ","
csv = "build/precision.csv"
subjects = "sphere cylinder cone cube torus triangle quadratic quartic"
forms = "'textbook float' 'textbook double' 'stable float' 'stable double' 'Moeller-Trumbore float' 'Moeller-Trumbore double' 'one triangle' 'program'"
array colour[8] = ["#d95f02", "#1b6ca8", "#e7298a", "#66a61e", "#c79a00", "#3fa7d6", "#7570b3", "#117733"]
array mark[8] = [5, 7, 8, 10, 4, 6, 9, 13]
is(subject, form) = strcol(1) eq subject && strcol(3) eq form
letter(set) = substr(set, 1, 1)

set logscale xy
set format y "10^{%L}"
set yrange [0.05:1e18]
set ytics 1e4
set mytics 4
set grid lc rgb "#cccccc"
unset key
array place[8] = [0.04, 0.15, 0.27, 0.37, 0.48, 0.635, 0.8, 0.91]
do for [i = 1:8] {
    set label i word(forms, i) at screen place[i], screen 0.025 point pt mark[i] ps 1.2 lc rgb colour[i] \
        textcolor rgb colour[i] offset character 1,0
}
set multiplot layout 4,4 margins 0.055,0.985,0.085,0.94 spacing 0.045,0.065 \
    title "Error of t (ulps of double) against ns per ray. Rays: o ordinary, f far, g grazing"
do for [row = 0:3] {
    do for [k = 1:4] {
        name = word(subjects, k + (row > 1 ? 4 : 0))
        error = 6 + row % 2
        set title name . (row % 2 == 0 ? ": median error" : ": worst error") offset 0,-0.6
        set xrange [(row > 1 && k > 2 || k == 1 ? 3 : 8) : (row < 2 ? 2000 : 20000)]
        if (name eq "triangle") { set xrange [8:300] }
        if (k == 1) { set ylabel "ulps" offset 1,0 } else { unset ylabel }
        if (row == 3) { set xlabel "ns per ray" } else { unset xlabel }
        plot for [i = 1:8] csv using (is(name, word(forms, i)) ? $9 : NaN):(column(error) > 0.15 ? column(error) : 0.15): \
                 (letter(strcol(2))) with labels point pt mark[i] ps 0.9 lc rgb colour[i] left offset character 0.6,0.15 \
                 textcolor rgb colour[i]
    }
}
unset multiplot
