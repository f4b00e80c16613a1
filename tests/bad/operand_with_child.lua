-- expect 1: tests/bad/operand_with_child.lua:3: cube 'c' is a CSG operand and can't have children
local root = gr.node('root')
local c = gr.cube('c'); local n = gr.union('u', c, gr.cube('d')); c:add_child(gr.node('x'))
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
