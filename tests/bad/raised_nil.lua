-- expect 1: tests/bad/raised_nil.lua:2: the script raised an error that is no text but nil
error()
