-- Two triangles of one mesh with texture coordinates of opposite turn, and texture coordinates below 0.
dofile 'lib/stage.lua'
local node = gr.mesh('folded', 'card_mirrored.obj')
node:add_texture('pattern.png')
show_at({0, 0, 4.5}, {place(node, red, 1.2, 0, 0, 0, 0)})
