-- expect 1: tests/bad/unknown_method.lua:2: unknown method node:tranlsate (did you mean node:translate?)
gr.sphere('s'):tranlsate(1, 2, 3)
