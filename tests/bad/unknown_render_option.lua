-- expect 1: tests/bad/unknown_render_option.lua:3: gr.render: unknown option 'maxdepth' (did you mean 'max_depth'?)
local n = gr.node('n')
gr.render(n, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})}, {maxdepth = 3})
