-- expect 3: tests/bad/grammar_missing.lua:3: can't open grammar/missing.grammar: No such file or directory
local root = gr.node('root')
local c = gr.cube('c'); c:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1)); local n = gr.tree('t', 'grammar/missing.grammar', 2, c, c)
root:add_child(n)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
