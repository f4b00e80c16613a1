-- Three circular waves of period 0.1 round the middle of the pool.
local show = dofile("show.lua")

show("waves_3.png", 3, 0.1)
