-- expect 1: tests/bad/stack_overflow.lua:2: stack overflow
local function deeper() return 1 + deeper() end
deeper()
