-- A fractal mountain of roughness 0.1 after 3 subdivisions: 864 faces.
local show = dofile("show.lua")

show("mountain_3.png", 0.1, 3)
