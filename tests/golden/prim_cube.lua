-- A cube, turned, and squashed by a scale of its own.
dofile 'lib/stage.lua'
local cube = gr.cube('cube')
cube:translate(-0.5, -0.5, -0.5)
cube:scale(1.6, 1, 1)
show(place(cube, green, 1, 30, 0, -0.5, 0))
