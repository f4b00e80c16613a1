-- u round the axis, v round the tube.
dofile 'lib/stage.lua'
local ring = gr.torus('ring', 0.5)
ring:add_texture('pattern.png')
show_at({0, 3, 3.5}, {place(ring, red, 0.9, 40, 0, 0, 0)})
