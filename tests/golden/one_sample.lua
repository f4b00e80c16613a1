-- One sample, at the pixel's centre: hard edges.
dofile 'lib/stage.lua'
show_at({0.9, 1.8, 4.5}, {floor(), place(gr.torus('ring', 0.4), green, 0.8, 0, 0, -0.6, 0)}, {samples = 1}, 64, 64)
