-- Two mirrors that face each other, to a depth of 2 only.
dofile 'lib/stage.lua'
local m = gr.reflective_material({0.1, 0.2, 0.1}, {0, 0, 0}, 1, 0.9)
local function wall(z) local n = gr.nh_box('wall', {-2, -1, z}, 4) n:scale(1, 0.6, 1) n:set_material(m) return n end
show_at({0.9, 0.9, 2.5}, {floor(), wall(-5.5), wall(3), place(gr.sphere('ball'), red, 0.5, 0, 0, -0.5, 0)}, {max_depth = 2})
