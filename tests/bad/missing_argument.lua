-- expect 1: tests/bad/missing_argument.lua:2: gr.torus: minor radius must be a number, but is missing
gr.torus('t')
