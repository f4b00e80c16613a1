-- A fractal mountain of roughness 0.1 after 2 subdivisions: 144 faces.
local show = dofile("show.lua")

show("mountain_2.png", 0.1, 2)
