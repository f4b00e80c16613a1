-- rt: --srgb
-- The scene of texture_cube, decoded and encoded.
dofile 'texture_cube.lua'
