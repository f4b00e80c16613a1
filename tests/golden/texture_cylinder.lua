-- The picture goes once round, upright; the cap has it too. Turned by -60 and 60 degrees to show the F and the seam.
dofile 'lib/stage.lua'
local function can(turn, x)
    local node = gr.cylinder('can')
    node:set_texture(gr.texture('pattern.png'))
    return place(node, red, 0.8, turn, x, 0, 0)
end
show_at({0, 2.2, 4.5}, {can(60, -0.9), can(180, 0.9)})
