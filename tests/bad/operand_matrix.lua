-- expect 1: tests/bad/operand_matrix.lua:3: sphere 'seed' has, as an operand, a singular matrix, or one too extreme to be inverted
local root, red = gr.node('root'), gr.material({1, 0, 0}, {0, 0, 0}, 1)
local function solid(name) local s = gr.sphere(name) s:set_material(red) return s end
local seed, rest = solid('seed'), solid('rest')
seed:scale(1e-200, 1e-200, 1e-200)
local inner = gr.union('inner', seed, solid('other'))
inner:scale(1e-200, 1e-200, 1e-200)
root:add_child(gr.union('outer', rest, inner))
gr.render(root, 'x.png', 8, 8, {0, 0, 9}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {gr.light({1, 2, 3}, {1, 1, 1}, {1, 0, 0})})
