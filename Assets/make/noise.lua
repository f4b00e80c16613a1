-- Value noise that repeats over the unit square, so that textures made of it tile without a seam.
local noise = {}

-- A fixed pseudo-random number in [0,1) for a lattice point (integer mixing after Wellons, "lowbias32").
local function hash(x, y, seed)
    local h = (x * 0x9E3779B1 ~ y * 0x85EBCA77 ~ seed * 0xC2B2AE3D) & 0xFFFFFFFF
    h = ((h ~ h >> 16) * 0x7FEB352D) & 0xFFFFFFFF
    h = ((h ~ h >> 15) * 0x846CA68B) & 0xFFFFFFFF
    return (h ~ h >> 16) / 0x100000000
end
noise.hash = hash

local function smooth(t)
    return t * t * (3 - 2 * t)
end

local function mix(a, b, t)
    return a + (b - a) * t
end
noise.mix = mix

-- A number in [0,1) at (u,v), with nx by ny lattice cells in the unit square.
function noise.value(u, v, nx, ny, seed)
    local x, y = u * nx, v * ny
    local i, j = math.floor(x), math.floor(y)
    local fx, fy = smooth(x - i), smooth(y - j)
    local i0, i1, j0, j1 = i % nx, (i + 1) % nx, j % ny, (j + 1) % ny
    return mix(mix(hash(i0, j0, seed), hash(i1, j0, seed), fx), mix(hash(i0, j1, seed), hash(i1, j1, seed), fx), fy)
end

-- Octaves of it, each twice as fine and half as strong as the one before; in [0,1).
function noise.fractal(u, v, nx, ny, octaves, seed)
    local sum, weight, total = 0, 1, 0
    for octave = 0, octaves - 1 do
        sum = sum + weight * noise.value(u, v, nx << octave, ny << octave, seed + octave)
        total = total + weight
        weight = weight / 2
    end
    return sum / total
end

function noise.mix_colour(a, b, t)
    return { mix(a[1], b[1], t), mix(a[2], b[2], t), mix(a[3], b[3], t) }
end

-- The colour at t of a list of {position, colour} with ascending positions.
function noise.ramp(stops, t)
    if t <= stops[1][1] then
        return stops[1][2]
    end
    for i = 2, #stops do
        if t <= stops[i][1] then
            local a, b = stops[i - 1], stops[i]
            return noise.mix_colour(a[2], b[2], (t - a[1]) / (b[1] - a[1]))
        end
    end
    return stops[#stops][2]
end

return noise
