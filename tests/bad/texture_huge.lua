-- expect 3: tests/bad/texture_huge.lua:3: tests/bad/png/huge.png: 1000000000 x 1000000000 pixels; at most 65535 a side and 268435456 in all are allowed
local root = gr.node('root')
local n = gr.sphere('s'); n:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)); n:add_texture('png/huge.png')
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
