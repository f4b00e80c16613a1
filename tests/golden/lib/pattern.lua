-- Writes ../pattern.png beside this file's folder: the texture of the golden pictures, a dark F on yellow with a blue left
-- and a green lower edge, so that turned, mirrored and shifted textures can be told. Run: lua5.4 lib/pattern.lua
local rows = {  -- from the top
    "byyyyyyy",
    "byrrrryy",
    "byryyyyy",
    "byrrryyy",
    "byryyyyy",
    "byryyyyy",
    "byyyyyyw",
    "bggggggg",
}
local colour = {b = "\30\60\220", g = "\20\160\60", r = "\150\20\30", y = "\240\220\120", w = "\255\255\255"}

local crc_table = {}
for i = 0, 255 do
    local c = i
    for _ = 1, 8 do c = c & 1 == 1 and 0xedb88320 ~ (c >> 1) or c >> 1 end
    crc_table[i] = c
end
local function chunk(kind, data)
    local c = 0xffffffff
    for i = 1, #kind + #data do c = crc_table[(c ~ (kind .. data):byte(i)) & 255] ~ (c >> 8) end
    return string.pack(">I4", #data) .. kind .. data .. string.pack(">I4", c ~ 0xffffffff)
end
local raw = {}
for _, row in ipairs(rows) do raw[#raw + 1] = "\0" .. row:gsub(".", colour) end
raw = table.concat(raw)
local a, b = 1, 0
for i = 1, #raw do a = (a + raw:byte(i)) % 65521; b = (b + a) % 65521 end
local zlib = "\x78\x01\1" .. string.pack("<I2I2", #raw, ~#raw & 0xffff) .. raw .. string.pack(">I4", b << 16 | a)

local file = assert(io.open(arg[0]:gsub("lib/pattern.lua$", "") .. "pattern.png", "wb"))
file:write("\x89PNG\r\n\x1a\n", chunk("IHDR", string.pack(">I4I4BBBBB", 8, 8, 8, 2, 0, 0, 0)), chunk("IDAT", zlib), chunk("IEND", ""))
file:close()
