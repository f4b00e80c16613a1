-- expect 1: tests/bad/singular_scale.lua:2: node:scale: y is 0: nothing would be left of 'flat'
gr.cube('flat'):scale(1, 0, 1)
