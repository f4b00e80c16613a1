-- expect 3: tests/bad/mesh_missing.lua:3: can't open obj/missing.obj: No such file or directory
local root = gr.node('root')
local n = gr.mesh('m', 'obj/missing.obj'); n:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
