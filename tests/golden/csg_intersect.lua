-- A die: the part of a cube that lies in a sphere, with both materials; and a lens of two spheres.
dofile 'lib/stage.lua'
local cube = gr.nh_box('cube', {-0.5, -0.5, -0.5}, 1)
cube:set_material(red)
local ball = gr.nh_sphere('ball', {0, 0, 0}, 0.68)
ball:set_material(blue)
local left, right = gr.nh_sphere('left', {-0.7, 0, 0}, 1), gr.nh_sphere('right', {0.7, 0, 0}, 1)
left:set_material(green)
right:set_material(matte)
show(place(gr.intersect('die', cube, ball), nil, 1.3, 25, -0.7, -0.3, 0),
     place(gr.intersection('lens', left, right), nil, 0.9, 30, 0.9, -0.3, 0.3))
