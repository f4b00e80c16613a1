-- A light within an open box lights it from inside; things beyond a light don't shade.
dofile 'lib/stage.lua'
lights = {gr.light({0, 0.4, -0.2}, {0.9, 0.8, 0.6}, {1, 0, 0})}
local outer = gr.nh_box('outer', {-1, -1, -1}, 2)
outer:set_material(matte)
local inner = gr.nh_box('inner', {-0.9, -0.9, -0.9}, 1.8)
local window = gr.nh_box('window', {-0.5, -0.9, 0}, 1.2)
show_at({1.3, 2.6, 6.5}, {floor(), gr.diff('room', gr.diff('hollow', outer, inner), window), place(gr.sphere('ball'), red, 0.2, 0, 0.3, -0.8, 1.6)})
