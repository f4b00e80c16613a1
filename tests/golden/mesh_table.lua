-- The older form: vertices and convex faces of 0-based indices.
dofile 'lib/stage.lua'
local prism = gr.mesh('prism', {
    {-0.8, -1, 0.6}, {0.8, -1, 0.6}, {0, 0.4, 0.6}, {-0.8, -1, -0.6}, {0.8, -1, -0.6}, {0, 0.4, -0.6},
}, {{0, 1, 2}, {5, 4, 3}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}})
show(place(prism, blue, 1, 25, 0, 0, 0))
