-- nh_sphere by centre and radius, nh_box by least corner and size; a child doesn't get its parent's own place and size.
dofile 'lib/stage.lua'
local box = gr.nh_box('box', {-1.4, -1, -0.5}, 1)
box:set_material(green)
local child = gr.nh_sphere('child', {-0.9, 0.3, 0}, 0.3)
child:set_material(blue)
box:add_child(child)
local ball = gr.nh_sphere('ball', {0.8, -0.4, 0}, 0.6)
ball:set_material(red)
show(box, ball)
