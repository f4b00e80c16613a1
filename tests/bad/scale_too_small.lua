-- expect 1: tests/bad/scale_too_small.lua:2: node:scale: the matrix of 'dust' can't be inverted or represented then
gr.cube('dust'):scale(1, 1e-320, 1)
