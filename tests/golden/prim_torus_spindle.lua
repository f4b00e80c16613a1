-- Minor radii of 1 and above: the horn and the spindle, which cover the hole; the notch of each is seen from above.
dofile 'lib/stage.lua'
show_at({0.5, 4, 3}, {floor(), place(gr.torus('horn', 1), blue, 0.38, 0, -0.85, -0.5, 0),
                      place(gr.torus('spindle', 1.3), red, 0.38, 0, 0.85, -0.4, 0)})
