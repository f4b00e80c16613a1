-- One circular wave of period 0.1 round the middle of the pool.
local show = dofile("show.lua")

show("waves_1.png", 1, 0.1)
