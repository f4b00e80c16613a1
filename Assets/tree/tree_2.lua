-- The branching tree after two replacements.
local show = dofile("show.lua")

show("tree_2.png", 2, 24)
