-- expect 3: tests/bad/texture_missing.lua:3: can't open png/missing.png: No such file or directory
local root = gr.node('root')
local n = gr.sphere('s'); n:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)); n:add_texture('png/missing.png')
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
