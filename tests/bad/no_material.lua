-- expect 1: tests/bad/no_material.lua:3: torus 'ring' has no material
local root = gr.node('root')
local n = gr.torus('ring', 0.25)
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
