-- expect 1: tests/bad/no_pixels.lua:2: gr.render: width must be at least 1, but is 0
gr.render(gr.node('n'), 'x.png', 0, 0, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
