-- A branching L-system of depth 2, all of it determined.
dofile 'lib/stage.lua'
local trunk, leaf = gr.cylinder('trunk'), gr.sphere('leaf')
trunk:set_material(matte)
leaf:set_material(green)
local tree = gr.tree('tree', 'tree.grammar', 2, trunk, leaf)
show(place(tree, nil, 0.13, 20, 0, -1, 0))
