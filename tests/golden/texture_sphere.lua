-- u begins behind (atan2(x, z) = -180 deg) and runs to the right as seen in front; seen from the front the middle of the picture.
dofile 'lib/stage.lua'
local ball = gr.sphere('ball')
ball:add_texture('pattern.png')
show_at({0, 0.6, 4.5}, {place(ball, red, 1.2, 0, 0, 0, 0)})
