-- Spheres of shares 0, 0.3, 0.6 and 1 on a mirroring floor.
dofile 'lib/stage.lua'
local nodes = {floor()}
nodes[1]:set_material(gr.reflective_material({0.5, 0.5, 0.5}, {0, 0, 0}, 1, 0.4))
for i, share in ipairs {0, 0.3, 0.6, 1} do
    local m = gr.reflective_material({0.8, 0.3, 0.1 + 0.2 * i}, {0.5, 0.5, 0.5}, 30, share)
    nodes[#nodes + 1] = place(gr.sphere('ball'), m, 0.48, 0, -2.5 + i, -0.52, 0)
end
show_at({0, 1.2, 5.5}, nodes, nil, 128, 80)
