-- expect 1: tests/bad/syntax.lua:3: unexpected symbol near '='
local root = gr.node('root')
x = = 3
