-- u begins behind (atan2(x, z) = -180 deg) and runs to the right as seen in front. Turned by 40 degrees to show the F.
dofile 'lib/stage.lua'
local ball = gr.sphere('ball')
ball:add_texture('pattern.png')
show_at({0, 0.6, 4.5}, {place(ball, red, 1.2, 40, 0, 0, 0)})
