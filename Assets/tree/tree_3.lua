-- The branching tree after three replacements.
local show = dofile("show.lua")

show("tree_3.png", 3, 50)
