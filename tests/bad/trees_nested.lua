-- expect 5: tests/bad/trees_nested.lua:4: trees are nested more than 16 deep
local root, leaf = gr.node('root'), gr.sphere('leaf')
leaf:set_material(gr.material({1, 0, 0}, {0, 0, 0}, 1))
for i = 1, 20 do leaf = gr.tree('tree' .. i, 'grammar/one.grammar', 1, leaf, leaf) end
root:add_child(leaf)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
