-- 144 faces, coloured by height.
dofile 'lib/stage.lua'
local m = gr.fractal_mountain('mountain', {3, 1.8, 3}, 0.1, 2, 5)
m:translate(-1.5, -1, 1.2)
show(m)
