-- expect 3: tests/bad/missing_module.lua:2: can't find the module 'none' as none.lua
require('none')
