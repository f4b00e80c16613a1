-- expect 3: tests/bad/missing_lines.lua:2: can't open none.txt: No such file or directory
for line in io.lines('none.txt') do print(line) end
