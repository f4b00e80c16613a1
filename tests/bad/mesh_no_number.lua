-- expect 3: tests/bad/obj/no_number.obj:2: 'zero' is not a number
local root = gr.node('root')
local n = gr.mesh('m', 'obj/no_number.obj'); n:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
