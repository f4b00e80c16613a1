-- The branching tree after one replacement.
local show = dofile("show.lua")

show("tree_1.png", 1, 10)
