-- Makes the textures of the scenes: lua5.4 Assets/make/textures.lua
local here = arg[0]:match("^(.*/)") or ""
package.path = here .. "?.lua;" .. package.path
local png, noise = require "png", require "noise"
local fractal, mix, mix_colour, ramp, hash = noise.fractal, noise.mix, noise.mix_colour, noise.ramp, noise.hash

local function scaled(c, k)
    return { c[1] * k, c[2] * k, c[3] * k }
end

local function clamp(x)
    return math.min(math.max(x, 0), 1)
end

-- Distance of x from the nearest integer, 0 to 1/2.
local function to_line(x)
    return math.abs(x - math.floor(x + 0.5))
end

-- The temple's materials.

-- Grain along v.
local function wood(dark, light, seed)
    return function(u, v)
        local bend = 0.06 * fractal(u, v, 2, 2, 2, seed)
        local rings = fractal(u + bend, v, 16, 1, 3, seed + 10)
        local pores = fractal(u, v, 64, 4, 2, seed + 20)
        return mix_colour(dark, light, clamp(1.5 * rings - 0.3 + 0.3 * (pores - 0.5)))
    end
end

-- Leaves of beaten gold in a 6 x 6 square, each of a slightly different tone, lapping over at their edges.
local function gold_leaf(u, v)
    local leaves = 6
    local tone = hash(math.floor(u * leaves), math.floor(v * leaves), 3)
    local edge = math.min(to_line(u * leaves), to_line(v * leaves)) < 0.03 and 0.9 or 1
    local wear = fractal(u, v, 12, 12, 3, 5)
    return scaled({ 0.93, 0.69, 0.24 }, edge * (0.86 + 0.1 * tone + 0.12 * (wear - 0.5)))
end

-- Boulders fitted together: the nearest of scattered points is a stone's middle, the second nearest tells the joint.
local function stones(across, seed)
    return function(u, v)
        local x, y = u * across, v * across
        local first, second, stone = 9, 9, 0
        for j = math.floor(y) - 1, math.floor(y) + 1 do
            for i = math.floor(x) - 1, math.floor(x) + 1 do
                local a, b = i % across, j % across
                local px, py = i + hash(a, b, seed), j + hash(a, b, seed + 1)
                local d = math.sqrt((px - x) ^ 2 + (py - y) ^ 2)
                if d < first then
                    first, second, stone = d, first, hash(a, b, seed + 2)
                elseif d < second then
                    second = d
                end
            end
        end
        local joint = clamp((second - first) * 7)
        local grain = fractal(u, v, 24, 24, 3, seed + 3)
        local c = mix_colour({ 0.42, 0.39, 0.36 }, { 0.62, 0.58, 0.5 }, stone)
        return scaled(c, (0.35 + 0.65 * joint) * (0.75 + 0.5 * grain))
    end
end

local function rock(u, v)
    local n = fractal(u, v, 5, 5, 5, 71)
    local lichen = clamp(6 * (fractal(u, v, 4, 4, 4, 72) - 0.58))
    return mix_colour(mix_colour({ 0.2, 0.18, 0.19 }, { 0.56, 0.52, 0.48 }, n), { 0.36, 0.4, 0.16 }, lichen)
end

local function moss(u, v)
    local n = fractal(u, v, 6, 6, 5, 31)
    local path = clamp(5 * (fractal(u, v, 3, 3, 3, 32) - 0.6))
    local green = mix_colour({ 0.1, 0.2, 0.05 }, { 0.36, 0.47, 0.12 }, n)
    return mix_colour(green, { 0.55, 0.45, 0.28 }, path)
end

local function bark(u, v)
    local n = fractal(u + 0.04 * fractal(u, v, 3, 6, 2, 41), v, 14, 4, 4, 42)
    return mix_colour({ 0.13, 0.08, 0.06 }, { 0.5, 0.34, 0.24 }, clamp(2 * n - 0.5))
end

-- The landscape.

-- A mountain seen from above, its peak in the middle: autumn woods, then bare rock.
local function autumn_mountain(u, v)
    local height = 1 - 2 * math.max(math.abs(u - 0.5), math.abs(v - 0.5))
    height = height + 0.35 * (fractal(u, v, 8, 8, 5, 51) - 0.5)
    local woods = ramp({
        { 0.30, { 0.08, 0.15, 0.07 } }, { 0.50, { 0.15, 0.23, 0.09 } }, { 0.62, { 0.25, 0.26, 0.10 } },
        { 0.72, { 0.33, 0.24, 0.10 } }, { 0.80, { 0.38, 0.19, 0.10 } },
    }, fractal(u, v, 26, 26, 5, 52))
    local crag = mix_colour({ 0.20, 0.19, 0.17 }, { 0.36, 0.32, 0.27 }, fractal(u, v, 24, 24, 4, 53))
    return mix_colour(woods, crag, clamp(5 * (height - 0.72)))
end

-- The same far away, where the air takes its colours toward the sky's.
local function far_mountain(u, v)
    local height = 1 - 2 * math.max(math.abs(u - 0.5), math.abs(v - 0.5))
    height = height + 0.3 * (fractal(u, v, 8, 8, 5, 61) - 0.5)
    local woods = mix_colour({ 0.22, 0.22, 0.34 }, { 0.34, 0.29, 0.36 }, fractal(u, v, 32, 32, 4, 62))
    local crag = mix_colour({ 0.32, 0.26, 0.36 }, { 0.46, 0.37, 0.42 }, fractal(u, v, 32, 32, 4, 63))
    local high = mix_colour(crag, { 0.74, 0.66, 0.72 }, clamp(6 * (height - 0.76)))
    return mix_colour(woods, high, clamp(4 * (height - 0.45)))
end

-- The lake from the near shore (v = 0) to the far one (v = 1): deep blue before the eye, then the sky's violet.
local function lake(_, v)
    return ramp({
        { 0.02, { 0.03, 0.36, 0.52 } }, { 0.09, { 0.05, 0.36, 0.58 } }, { 0.17, { 0.18, 0.40, 0.66 } },
        { 0.30, { 0.38, 0.42, 0.72 } }, { 0.55, { 0.58, 0.44, 0.66 } },
    }, v)
end

-- The gallery.

-- A planet of our own, u going once round: seas, land by height, ice at the poles.
local function planet(u, v)
    local height = fractal(u, v, 6, 4, 6, 81)
    local cold = math.abs(v - 0.5) * 2 + 0.25 * (fractal(u, v, 8, 4, 4, 82) - 0.5)
    local ground = ramp({
        { 0.30, { 0.02, 0.08, 0.30 } }, { 0.49, { 0.10, 0.38, 0.62 } }, { 0.50, { 0.80, 0.72, 0.45 } },
        { 0.53, { 0.22, 0.48, 0.14 } }, { 0.62, { 0.40, 0.42, 0.16 } }, { 0.70, { 0.55, 0.42, 0.30 } },
        { 0.76, { 0.95, 0.95, 0.95 } },
    }, height)
    return mix_colour(ground, { 0.93, 0.95, 0.97 }, clamp(10 * (cold - 0.86)))
end

-- 5 x 7 dots of the letters that stand on things; each row from the top, its leftmost dot in the bit of value 16.
local letters = {
    R = { 30, 17, 17, 30, 20, 18, 17 },
    T = { 31, 4, 4, 4, 4, 4, 4 },
    L = { 16, 16, 16, 16, 16, 16, 31 },
    U = { 17, 17, 17, 17, 17, 17, 14 },
    A = { 14, 17, 17, 31, 17, 17, 17 },
}

-- True where a dot of `text` is, the whole text filling [0,1]^2.
local function written(text, u, v)
    if u < 0 or u >= 1 or v < 0 or v >= 1 then
        return false
    end
    local column = math.floor(u * (6 * #text - 1))
    local letter = letters[text:sub(column // 6 + 1, column // 6 + 1)]
    local row = math.floor((1 - v) * 7) + 1
    return column % 6 < 5 and letter[math.min(row, 7)] & 16 >> column % 6 ~= 0
end

local crate_wood = wood({ 0.42, 0.25, 0.11 }, { 0.78, 0.56, 0.30 }, 91)

-- Boards in a frame with a stencilled RT.
local function crate(u, v)
    local edge = math.min(u, v, 1 - u, 1 - v)
    if edge < 0.11 then
        local c = math.min(u, 1 - u) < math.min(v, 1 - v) and crate_wood(u * 0.7, v) or crate_wood(v * 0.7, u)
        return scaled(c, edge > 0.1 and 0.4 or 1.1)
    end
    if written("RT", (u - 0.25) / 0.5, (v - 0.3) / 0.4) then
        return { 0.13, 0.11, 0.1 }
    end
    return scaled(crate_wood(v, u), to_line(v * 4) < 0.03 and 0.45 or 0.9)
end

-- The label of a tin: bands, a wave, and LUA three times round.
local function label(u, v)
    if v < 0.1 or v > 0.9 then
        return { 0.85, 0.65, 0.2 }
    end
    if written("LUA", ((u * 3) % 1 - 0.2) / 0.6, (v - 0.4) / 0.35) then
        return { 0.95, 0.93, 0.85 }
    end
    if v < 0.24 + 0.06 * math.sin(2 * math.pi * 6 * u) then
        return { 0.08, 0.42, 0.5 }
    end
    return mix_colour({ 0.62, 0.08, 0.1 }, { 0.78, 0.14, 0.12 }, v)
end

-- Stripes that climb round an axis, 8 of them, once round in the height.
local function spiral(u, v)
    return (u * 8 + v * 4) % 1 < 0.5 and { 0.9, 0.88, 0.8 } or { 0.75, 0.16, 0.24 }
end

-- Scales that lap over each other.
local function scales(u, v)
    local columns, rows = 24, 12
    local row = math.floor(v * rows)
    local x = (u * columns + (row % 2) / 2) % 1 - 0.5
    local y = v * rows - row
    local inside = x * x + (1 - y) ^ 2 * 0.6 < 0.3
    local tone = inside and (1 - 0.6 * y) or 0.35
    return scaled({ 0.25, 0.75, 0.62 }, 0.35 + 0.65 * tone)
end

local function parquet(u, v)
    local blocks = 4
    local i, j = math.floor(u * blocks), math.floor(v * blocks)
    local x, y = u * blocks - i, v * blocks - j
    if (i + j) % 2 == 1 then
        x, y = y, x
    end
    local board = math.floor(x * 4)
    local tone = 0.75 + 0.35 * hash(i * 4 + board, j, 95)
    local seam = (to_line(x * 4) < 0.05 or to_line(y) < 0.02) and 0.6 or 1
    return scaled(crate_wood(x, y * 0.5), tone * seam)
end

local function damask(u, v)
    local function motif(x, y)
        local r = math.sqrt(x * x + y * y)
        return r < 0.34 + 0.1 * math.cos(6 * math.atan(y, x)) and r > 0.1
    end
    local n = 4
    local x, y = (u * n) % 1 - 0.5, (v * n) % 1 - 0.5
    local shifted_x, shifted_y = (u * n + 0.5) % 1 - 0.5, (v * n + 0.5) % 1 - 0.5
    local on = motif(x * 1.6, y * 1.6) or motif(shifted_x * 2.4, shifted_y * 2.4)
    return on and { 0.30, 0.38, 0.36 } or { 0.24, 0.31, 0.30 }
end

local textures = {
    { "final/wood.png", 128, 128, wood({ 0.24, 0.13, 0.08 }, { 0.50, 0.31, 0.18 }, 11) },
    { "final/gold_leaf.png", 192, 192, gold_leaf },
    { "final/stones.png", 256, 256, stones(10, 21) },
    { "final/rock.png", 128, 128, rock },
    { "final/moss.png", 192, 192, moss },
    { "final/bark.png", 128, 128, bark },
    { "final/autumn_mountain.png", 256, 256, autumn_mountain },
    { "final/far_mountain.png", 192, 192, far_mountain },
    { "final/lake.png", 4, 256, lake },
    { "texture/planet.png", 256, 192, planet },
    { "texture/crate.png", 160, 160, crate },
    { "texture/label.png", 288, 96, label },
    { "texture/spiral.png", 128, 128, spiral },
    { "texture/scales.png", 192, 96, scales },
    { "texture/parquet.png", 192, 192, parquet },
    { "texture/damask.png", 128, 128, damask },
}
for _, t in ipairs(textures) do
    png.write(here .. "../" .. t[1], t[2], t[3], t[4])
end
