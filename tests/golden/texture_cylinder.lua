-- The picture goes once round, upright; the cap by (x, z), so mirrored. Turned by 40 and 180 degrees to show the F and the seam.
dofile 'lib/stage.lua'
local function can(turn, x)
    local node = gr.cylinder('can')
    node:set_texture(gr.texture('pattern.png'))
    return place(node, red, 0.6, turn, x, 0, 0)
end
show_at({0, 2.2, 4.5}, {can(40, -0.75), can(180, 0.75)})
