-- expect 5: tests/bad/too_many_pixels.lua:2: gr.render: width is 1000000: the limit is 65535 pixels
gr.render(gr.node('n'), 'x.png', 1000000, 1000000, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
