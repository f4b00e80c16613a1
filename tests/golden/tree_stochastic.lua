-- Rules with probabilities, one of which lets the symbol disappear; a seed.
dofile 'lib/stage.lua'
local trunk, leaf = gr.cylinder('trunk'), gr.cone('leaf')
trunk:set_material(matte)
leaf:set_material(red)
show(place(gr.tree('flower', 'flower.grammar', 4, trunk, leaf, 7), nil, 0.17, 0, -0.7, -1, 0),
     place(gr.tree('flower', 'flower.grammar', 4, trunk, leaf, 8), nil, 0.17, 0, 0.7, -1, 0))
