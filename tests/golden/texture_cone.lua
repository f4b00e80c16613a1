-- Round the cone once; v = 1 at the apex. The other shows its base, which is by (x, z).
dofile 'lib/stage.lua'
local function hat(turn, x, tilt)
    local node = gr.cone('hat')
    node:add_texture('pattern.png')
    node:rotate('x', tilt)
    return place(node, red, 1.1, turn, x, 0.5, 0)
end
show_at({0, 1, 6}, {hat(40, -0.75, 0), hat(0, 0.85, 100)})
