-- A mesh without vt: the barycentric pair of each triangle.
dofile 'lib/stage.lua'
local node = gr.mesh('octahedron', 'octahedron.obj')
node:add_texture('pattern.png')
show(place(node, red, 1.2, 20, 0, 0.2, 0))
