-- 24 faces with a texture, (u,v) = (x/w, z/l), and a material that gives highlights.
dofile 'lib/stage.lua'
local m = gr.fractal_mountain('mountain', {3, 1.8, 3}, 0.2, 1, 2)
m:set_material(red)
m:add_texture('pattern.png')
m:translate(-1.5, -1, 1.2)
show(m)
