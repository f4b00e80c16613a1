-- expect 5: tests/bad/caught_too_late.lua:2: 30 subdivisions of a mountain; the limit is 9
local n = gr.fractal_mountain('alps', {1, 1, 1}, 0.1, 30)
pcall(gr.render, n, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
