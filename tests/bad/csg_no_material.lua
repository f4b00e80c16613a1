-- expect 1: tests/bad/csg_no_material.lua:3: sphere 'a' has no material
local root = gr.node('root')
local n = gr.union('u', gr.sphere('a'), gr.sphere('b'))
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
