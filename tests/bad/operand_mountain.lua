-- expect 1: tests/bad/operand_mountain.lua:2: gr.diff: operand B, 'alps', is a mountain, which has no bottom
gr.diff('d', gr.cube('c'), gr.fractal_mountain('alps', {1, 1, 1}, 0.1, 1))
