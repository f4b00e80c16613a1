-- expect 3: tests/bad/texture_truncated.lua:3: tests/bad/png/truncated.png: the file is cut off
local root = gr.node('root')
local n = gr.sphere('s'); n:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)); n:add_texture('png/truncated.png')
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
