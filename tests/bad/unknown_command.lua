-- expect 1: tests/bad/unknown_command.lua:2: unknown command gr.spere (did you mean gr.sphere?)
local s = gr.spere('s')
