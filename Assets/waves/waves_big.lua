-- Waves of period 0.5: two of them reach beyond the pool.
local show = dofile("show.lua")

show("waves_big.png", 2, 0.5)
