-- expect 5: tests/bad/mountain_too_fine.lua:3: 30 subdivisions of a mountain; the limit is 9
local root = gr.node('root')
local n = gr.fractal_mountain('alps', {1, 1, 1}, 0.1, 30)
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
