-- Matrices apply in the order written, a parent's after its child's; one node under four parents; negative and uneven scales.
dofile 'lib/stage.lua'
local arm = gr.node('arm')
local bar = gr.nh_box('bar', {0, -0.1, -0.1}, 1)
bar:scale(0.7, 0.2, 0.2)
bar:set_material(blue)
local tip = gr.cone('tip')
tip:set_material(red)
tip:scale(0.2, 0.4, 0.2)
tip:translate(0.7, 0.3, 0)
bar:add_child(place(gr.sphere('end'), green, 0.2, 0, 1, 0, 0))
arm:add_child(bar)
arm:add_child(tip)
local nodes = {floor()}
for i = 0, 3 do
    local joint = gr.joint('joint', {-10, 0, 10}, {0, 0, 0})
    joint:add_child(arm)
    joint:rotate('Z', 20)
    if i == 3 then joint:scale(1, -1, 1.5) end
    joint:rotate('y', 90 * i + 20)
    joint:translate(0, -0.3, 0)
    nodes[#nodes + 1] = joint
end
show_at({0.9, 2.8, 4.5}, nodes)
