-- expect 3: tests/bad/grammar/two_meanings.grammar:3: 'F' has two meanings; the first is on line 2
local root = gr.node('root')
local c = gr.cube('c'); c:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)); local n = gr.tree('t', 'grammar/two_meanings.grammar', 2, c, c)
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
