-- expect 3: tests/bad/grammar/unpaired.grammar:4: '(' is not closed
local root = gr.node('root')
local c = gr.cube('c'); c:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)); local n = gr.tree('t', 'grammar/unpaired.grammar', 2, c, c)
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
