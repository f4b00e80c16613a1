-- The temple's first storey: a veranda behind four pillars, walls of wooden lattice, paper screens and plaster.
local floor = dofile("../final/floor.lua")
local show = dofile("show.lua")

show("temple_floor_1.png", floor.first(), { 0, 14, 34 }, 29, 1)
