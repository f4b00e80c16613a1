-- expect 1: tests/bad/operand_group.lua:2: gr.diff: operand A, 'g', is a group, not a solid
gr.diff('d', gr.node('g'), gr.sphere('s'))
