-- Two circular waves of period 0.1 round the middle of the pool.
local show = dofile("show.lua")

show("waves_2.png", 2, 0.1)
