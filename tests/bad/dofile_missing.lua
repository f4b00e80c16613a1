-- expect 3: tests/bad/dofile_missing.lua:2: can't open none.lua: No such file or directory
dofile('none.lua')
