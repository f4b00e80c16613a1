-- expect 1: tests/bad/nan.lua:2: node:translate: z must be a finite number, but is nan
gr.node('n'):translate(0, 0, 0 / 0)
