-- A cube with a sphere bitten off its front corner and a hole from top to bottom: the bite is the cube's red.
dofile 'lib/stage.lua'
local cube = gr.nh_box('cube', {-0.5, -0.5, -0.5}, 1)
cube:set_material(red)
local hole = gr.cylinder('hole')
hole:scale(0.2, 1, 0.2)
local bite = gr.nh_sphere('bite', {0.5, 0.5, 0.5}, 0.45)
show(place(gr.diff('carved', gr.diff('bitten', cube, bite), hole), nil, 1.5, 10, 0, -0.25, 0))
