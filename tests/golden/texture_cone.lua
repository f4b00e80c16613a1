-- Round the cone once; v = 1 at the apex.
dofile 'lib/stage.lua'
local function hat(turn, x, tilt)
    local node = gr.cone('hat')
    node:add_texture('pattern.png')
    node:rotate('x', tilt)
    return place(node, red, 1.5, turn, x, 0.8, 0)
end
show_at({0, 1, 4.5}, {hat(60, -0.9, 0), hat(0, 0.9, -60)})
