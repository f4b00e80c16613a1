-- The three faces that texture_cube doesn't show.
dofile 'lib/stage.lua'
lights[1] = gr.light({-5, -6, -6}, {0.8, 0.8, 0.8}, {1, 0, 0})
local cube = gr.cube('cube')
cube:translate(-0.5, -0.5, -0.5)
cube:add_texture('pattern.png')
show_at({-2.2, -2.2, -3.5}, {place(cube, red, 1.7, 0, 0, 0, 0)})
