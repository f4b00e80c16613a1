-- rt: --size 120x60
-- Another size than the script's: pixels stay square, the vertical angle stays.
dofile 'prim_sphere.lua'
