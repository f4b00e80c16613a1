-- expect 1: tests/bad/nested_too_large.lua:2: sphere 'giant' reaches beyond the range of numbers
local root, giant = gr.node('root'), gr.sphere('giant')
giant:set_material(gr.material({1, 0, 0}, {0, 0, 0}, 1))
giant:scale(1e200, 1e200, 1e200)
root:add_child(giant)
root:scale(1e200, 1e200, 1e200)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
