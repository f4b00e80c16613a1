-- expect 3: tests/bad/obj/two_vertices.obj:3: a face of two vertices
local root = gr.node('root')
local n = gr.mesh('m', 'obj/two_vertices.obj'); n:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
