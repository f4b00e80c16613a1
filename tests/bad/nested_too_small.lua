-- expect 1: tests/bad/nested_too_small.lua:2: sphere 'speck' has a singular matrix, or one too extreme to be inverted
local root, speck = gr.node('root'), gr.sphere('speck')
speck:set_material(gr.material({1, 0, 0}, {0, 0, 0}, 1))
speck:scale(1e-200, 1e-200, 1e-200)
root:add_child(speck)
root:scale(1e-200, 1e-200, 1e-200)
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
