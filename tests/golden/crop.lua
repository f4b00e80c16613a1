-- rt: --crop 20,30,84,70
-- A part of the picture of csg_nested.
dofile 'csg_nested.lua'
