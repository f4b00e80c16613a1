-- expect 1: tests/bad/own_child.lua:3: node:add_child: 'n' can't be its own child
local n = gr.node('n')
n:add_child(n)
