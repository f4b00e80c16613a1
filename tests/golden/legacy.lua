-- rt: --legacy
-- A script of before 2015: post-multiplied transforms, names of Lua 5.1.
local m = gr.material({0.8, 0.3, 0.2}, {0.3, 0.3, 0.3}, math.pow(2, 4))
local root = gr.node('root')
for i = 1, table.getn({1, 2, 3}) do
    local cube = gr.cube('cube')
    cube:set_material(m)
    cube:rotate('y', 30 * i)
    cube:translate(unpack({1.2, 0, 0}))
    cube:scale(0.8, 0.5 * i, 0.8)
    root:add_child(cube)
end
root:rotate('y', 40)
gr.render(root, 'golden.png', 80, 80, {0, 3, 6}, {0, -2.2, -6}, {0, 1, 0}, 30, {0.3, 0.3, 0.3}, {gr.light({5, 6, 6}, {0.8, 0.8, 0.8}, {1, 0, 0})})
