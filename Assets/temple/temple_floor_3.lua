-- The temple's third storey: cusped windows and folding doors under the upper roof, the phoenix on top.
local pavilion = dofile("../final/pavilion.lua")
local show = dofile("show.lua")

show("temple_floor_3.png", pavilion.third_storey(), { 0, 3.2, 28 }, 28, 3.6)
