-- A fractal mountain of roughness 0.1 after 1 subdivision: 24 faces.
local show = dofile("show.lua")

show("mountain_1.png", 0.1, 1)
