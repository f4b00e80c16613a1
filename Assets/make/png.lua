-- Writes 8-bit RGB PNG files in plain Lua 5.4. The pixels go into stored (uncompressed) deflate blocks, so the file is
-- about as large as its pixels: meant for textures of a few hundred texels a side.
local png = {}

local crc_table = {}
for n = 0, 255 do
    local c = n
    for _ = 1, 8 do
        c = c & 1 == 1 and 0xEDB88320 ~ (c >> 1) or c >> 1
    end
    crc_table[n] = c
end

local function crc32(data)
    local c = 0xFFFFFFFF
    for i = 1, #data do
        c = crc_table[(c ~ data:byte(i)) & 0xFF] ~ (c >> 8)
    end
    return c ~ 0xFFFFFFFF
end

local function adler32(data)
    local a, b = 1, 0
    for i = 1, #data do
        a = (a + data:byte(i)) % 65521
        b = (b + a) % 65521
    end
    return b << 16 | a
end

local function chunk(kind, data)
    return string.pack(">I4", #data) .. kind .. data .. string.pack(">I4", crc32(kind .. data))
end

local function zlib_stored(data)
    local largest = 65535
    local parts = { "\x78\x01" }
    for first = 1, #data, largest do
        local block = data:sub(first, first + largest - 1)
        local final = first + largest > #data and 1 or 0
        parts[#parts + 1] = string.pack("<I1I2I2", final, #block, ~#block & 0xFFFF) .. block
    end
    parts[#parts + 1] = string.pack(">I4", adler32(data))
    return table.concat(parts)
end

local function to_byte(x)
    return math.floor(255 * math.min(math.max(x, 0), 1) + 0.5)
end

-- Writes width x height texels; colour(u, v) gives {r, g, b} in [0,1] at a texel's centre, (0,0) being the lower left.
function png.write(path, width, height, colour)
    local rows = {}
    for y = 1, height do
        local row = { "\0" }
        for x = 1, width do
            local c = colour((x - 0.5) / width, 1 - (y - 0.5) / height)
            row[#row + 1] = string.char(to_byte(c[1]), to_byte(c[2]), to_byte(c[3]))
        end
        rows[y] = table.concat(row)
    end
    local header = string.pack(">I4I4I1I1I1I1I1", width, height, 8, 2, 0, 0, 0)
    local file = assert(io.open(path, "wb"))
    file:write("\x89PNG\r\n\x1a\n", chunk("IHDR", header), chunk("IDAT", zlib_stored(table.concat(rows))),
        chunk("IEND", ""))
    file:close()
end

return png
