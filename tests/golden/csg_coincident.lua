-- Faces that coincide: a slot that ends flush with the top leaves no film; a union's shared face shows the first's colour.
dofile 'lib/stage.lua'
local block = gr.nh_box('block', {-1, -1, -1}, 2)
block:set_material(red)
local slot = gr.cube('slot')
slot:scale(1, 1, 2)
slot:translate(-0.5, 0, -1)
local a, b = gr.cube('a'), gr.cube('b')
a:set_material(green)
b:set_material(blue)
b:translate(0.5, 0, 0)
show(place(gr.diff('slotted', block, slot), nil, 0.5, 20, -0.8, -0.5, 0), place(gr.union('pair', a, b), nil, 0.7, 0, 0.1, -1, 0))
