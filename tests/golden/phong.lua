-- Exponents 0, 1, 10 and 200.
dofile 'lib/stage.lua'
local nodes = {}
for i, p in ipairs {0, 1, 10, 200} do
    nodes[i] = place(gr.sphere('ball'), gr.material({0.3, 0.1, 0.1}, {0.6, 0.6, 0.6}, p), 0.48, 0, -2.5 + i, 0, 0)
end
show_at({0, 0.5, 5.5}, nodes, nil, 128, 64)
