-- expect 1: tests/bad/short_table.lua:2: gr.material: ks must be a table of 3 numbers, but has 2
gr.material({1, 1, 1}, {1, 1}, 5)
