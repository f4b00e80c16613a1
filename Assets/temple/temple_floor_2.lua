-- The temple's second storey with its terrace and the lower roof, all covered with gold leaf.
local floor = dofile("../final/floor.lua")
local roof = dofile("../final/roof.lua")
local show = dofile("show.lua")

local storey = gr.node("storey")
storey:add_child(floor.second())
local lower_roof = roof.make("lower", floor.lower.z)
lower_roof:translate(0, 2.5, 0)
storey:add_child(lower_roof)

show("temple_floor_2.png", storey, { 0, 4.2, 38 }, 30, 2.2)
