-- Each face carries the whole picture, upright from outside; the top by (x, z), so mirrored.
dofile 'lib/stage.lua'
local cube = gr.nh_box('cube', {-0.5, -0.5, -0.5}, 1)
cube:add_texture('pattern.png')
show_at({2.2, 2.2, 3.5}, {place(cube, red, 1.7, 0, 0, 0, 0)})
