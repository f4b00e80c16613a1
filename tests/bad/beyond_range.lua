-- expect 1: tests/bad/beyond_range.lua:2: sphere 'ball' reaches beyond the range of numbers
local root, ball = gr.node('root'), gr.sphere('ball')
ball:set_material(gr.material({1, 0, 0}, {0, 0, 0}, 1))
ball:scale(1e308, 1e308, 1e308)
ball:translate(1.5e308, 0, 0)
root:add_child(ball)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
