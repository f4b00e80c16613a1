-- expect 1: tests/bad/operand_too_large.lua:3: cube 'box' has, as an operand, a singular matrix, or one too extreme to be inverted
local root, red = gr.node('root'), gr.material({1, 0, 0}, {0, 0, 0}, 1)
local box = gr.cube('box')
box:set_material(red)
box:scale(1e200, 1, 1)
local inner = gr.diff('inner', box, gr.sphere('hole'))
inner:scale(1e200, 1, 1)
root:add_child(gr.union('outer', inner, box))
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
