-- Coloured lights with falloff from both sides, coloured shadows; a light below the floor gives nothing.
dofile 'lib/stage.lua'
lights = {
    gr.light({3, 2, 2}, {9, 2, 1}, {0, 0, 1}),
    gr.light({-3, 2, 2}, {1, 3, 6}, {0.5, 1, 0}),
    gr.light({0, -3, 0}, {1, 1, 1}, {1, 0, 0}),
}
show(place(gr.sphere('ball'), gr.material({0.7, 0.7, 0.7}, {0.5, 0.5, 0.5}, 40), 0.6, 0, 0, -0.4, 0))
