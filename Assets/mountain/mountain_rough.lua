-- A fractal mountain of roughness 0.5 after 2 subdivisions: five times as rough as mountain_2.
local show = dofile("show.lua")

show("mountain_rough.png", 0.5, 2)
