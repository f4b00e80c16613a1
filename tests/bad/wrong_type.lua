-- expect 1: tests/bad/wrong_type.lua:2: node:scale: y must be a number, but is 'wide'
gr.node('n'):scale(1, 'wide', 1)
