-- Waves of three periods from the middle of a matte and of a mirroring sheet.
dofile 'lib/stage.lua'
local matt = gr.mesh('matt', 'sheet.obj')
matt:set_material(blue)
matt:mesh_add_bumps({0.5, 0.5}, 3, 0.12)
matt:translate(-1.1, 0, 0)
local lake = gr.mesh('lake', 'sheet.obj')
lake:set_material(gr.reflective_material({0.2, 0.3, 0.6}, {0.3, 0.3, 0.3}, 20, 0.8))
lake:mesh_add_bumps({0.5, 0.5}, 2, 0.2)
lake:translate(1.1, 0, 0)
show_at({0, 2.5, 4.5}, {matt, lake, place(gr.sphere('ball'), red, 0.5, 0, 1.1, 0.6, -1.4)}, nil, 128, 80)
