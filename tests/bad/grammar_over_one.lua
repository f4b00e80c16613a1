-- expect 3: tests/bad/grammar/over_one.grammar:4: the probabilities of 'F' add up to 1.1, which is more than 1
local root = gr.node('root')
local c = gr.cube('c'); c:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)); local n = gr.tree('t', 'grammar/over_one.grammar', 2, c, c)
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
