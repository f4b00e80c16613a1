-- expect 1: tests/bad/part/inner.lua:2: gr.sphere: name must be a string, but is missing
dofile('part/inner.lua')
