-- Makes the islands, the temple's stone base, the lake and the leaves: lua5.4 Assets/make/land.lua
local here = arg[0]:match("^(.*/)") or ""
package.path = here .. "?.lua;" .. package.path
local obj, noise = require "obj", require "noise"

-- An island as a height field: round the middle at most `height` high, falling to below the water at `radius`, with
-- an uneven shore.
local function island(path, centre, radius, height, cells, seed)
    local function level(x, z)
        local dx, dz = (x - centre[1]) / radius[1], (z - centre[2]) / radius[2]
        local r = math.sqrt(dx * dx + dz * dz)
        local shore = 0.75 + 0.4 * noise.fractal(x / 40, z / 40, 6, 6, 3, seed)
        local t = math.max(0, math.min(1, (shore - r) / 0.3 + 0.45))
        local bumps = noise.fractal(x / 40, z / 40, 12, 12, 3, seed + 5)
        return -0.35 + (height + 0.35) * t * t * (3 - 2 * t) * (0.75 + 0.5 * bumps)
    end
    local function normal(x, z)
        local h = 0.1
        local n = { level(x - h, z) - level(x + h, z), 2 * h, level(x, z - h) - level(x, z + h) }
        local l = math.sqrt(n[1] ^ 2 + n[2] ^ 2 + n[3] ^ 2)
        return { n[1] / l, n[2] / l, n[3] / l }
    end
    local mesh = obj.new("island, made by make/land.lua")
    local function corner(i, j)
        local x = centre[1] + radius[1] * 1.25 * (2 * i / cells - 1)
        local z = centre[2] + radius[2] * 1.25 * (1 - 2 * j / cells)
        return { { x, level(x, z), z }, { x / 6, -z / 6 }, normal(x, z) }
    end
    for j = 0, cells - 1 do
        for i = 0, cells - 1 do
            local a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
            if math.max(a[1][2], b[1][2], c[1][2], d[1][2]) > -0.3 then
                mesh:face(a, b, c, d)
            end
        end
    end
    mesh:write(path)
end

-- A block with sloping sides of half-widths x and z at the top, its texture 3 units wide.
local function base(path, x, z, top, bottom, slope)
    local mesh = obj.new("stone base, made by make/land.lua")
    local wide = { x + slope, z + slope }
    local function side(half, out, wide_half, wide_out, turn)
        local function at(px, py, pz)
            for _ = 1, turn do
                px, pz = pz, -px
            end
            return { px, py, pz }
        end
        mesh:face({ at(-wide_half, bottom, wide_out), { -wide_half / 3, bottom / 3 } },
            { at(wide_half, bottom, wide_out), { wide_half / 3, bottom / 3 } },
            { at(half, top, out), { half / 3, top / 3 } }, { at(-half, top, out), { -half / 3, top / 3 } })
    end
    side(x, z, wide[1], wide[2], 0)
    side(z, x, wide[2], wide[1], 1)
    side(x, z, wide[1], wide[2], 2)
    side(z, x, wide[2], wide[1], 3)
    local function up(px, pz)
        return { { px, top, pz }, { px / 3, -pz / 3 } }
    end
    mesh:face(up(-x, z), up(x, z), up(x, -z), up(-x, -z))
    mesh:write(path)
end

-- The unit square about the origin, facing up; v runs away from the viewer. It stops just short of the texture's edges,
-- where the picture would begin to repeat.
local function lake(path)
    local mesh = obj.new("lake, made by make/land.lua")
    local function corner(x, z)
        return { { x, 0, z }, { x + 0.5, 0.5 - 0.99 * z } }
    end
    mesh:face(corner(-0.5, 0.5), corner(0.5, 0.5), corner(0.5, -0.5), corner(-0.5, -0.5))
    mesh:write(path)
end

-- A maple leaf of five narrow lobes; at(x, y) gives the place of the point x across and y along it.
local function leaf(mesh, reach, at)
    for lobe = -2, 2 do
        local angle = math.rad(42 * lobe)
        local long, wide = reach * (1 - 0.16 * math.abs(lobe)), 0.15 * reach
        local s, c = math.sin(angle), math.cos(angle)
        local root = 0.22 * reach
        mesh:face({ at(0, root) }, { at(s * long * 0.5 + c * wide, root + c * long * 0.5 - s * wide) },
            { at(s * long, root + c * long) }, { at(s * long * 0.5 - c * wide, root + c * long * 0.5 + s * wide) })
    end
end

-- A tuft of three leaves within about the unit sphere, and one fallen leaf, flat on the water.
local function leaves(tuft_path, fallen_path)
    local tuft = obj.new("tuft of leaves, made by make/land.lua")
    for i = 0, 2 do
        local turn, tilt = i * 2.1 + 0.3, 0.25 + 0.2 * i
        leaf(tuft, 0.85, function(x, y)
            local z, c, s = y * math.cos(tilt), math.cos(turn), math.sin(turn)
            return { x * c + z * s, y * math.sin(tilt), z * c - x * s }
        end)
    end
    tuft:write(tuft_path)
    local fallen = obj.new("fallen leaf, made by make/land.lua")
    leaf(fallen, 1, function(x, y) return { x, 0, -y } end)
    fallen:write(fallen_path)
end

-- A conifer of unit height: tiers of cones, each a jagged star seen from above.
local function conifer(path)
    local mesh = obj.new("conifer, made by make/land.lua")
    local points = 14
    for tier = 0, 3 do
        local bottom, top, wide = 0.1 + 0.2 * tier, 0.46 + 0.18 * tier, 0.27 - 0.055 * tier
        local function rim(i)
            local angle, reach = 2 * math.pi * (i + tier / 2) / points, i % 2 == 0 and wide or 0.62 * wide
            return { { reach * math.sin(angle), bottom + (i % 2 == 0 and 0 or 0.05), reach * math.cos(angle) } }
        end
        for i = 0, points - 1 do
            mesh:face(rim(i), rim((i + 1) % points), { { 0, top, 0 } })
        end
    end
    mesh:write(path)
end

-- The crown of a leafy tree, of unit height: a cloud of leaves about an ellipsoid.
local function crown(path)
    local mesh = obj.new("tree crown, made by make/land.lua")
    for i = 1, 170 do
        local function random(k)
            return noise.hash(i, k, 151)
        end
        local y, around = 2 * random(1) - 1, 2 * math.pi * random(2)
        local reach, level = math.sqrt(1 - y * y), 0.75 + 0.35 * random(3)
        local x, z = reach * math.sin(around) * 0.46 * level, reach * math.cos(around) * 0.46 * level
        local function tip(a, size)
            local across, up = size * math.cos(a), size * math.sin(a)
            return { { x + across * math.cos(around), 0.54 + 0.46 * y * level + up * (1.2 - math.abs(y)),
                z - across * math.sin(around) - up * y * 0.8 } }
        end
        local turn = 2 * math.pi * random(4)
        mesh:face(tip(turn, 0.13), tip(turn + 1.6, 0.09), tip(turn + 3.1, 0.13), tip(turn + 4.7, 0.08))
    end
    mesh:write(path)
end

-- A wild goose in flight, a unit long, its head to -x, its wings 2 wide and raised.
local function goose(path)
    local mesh = obj.new("goose, made by make/land.lua")
    local function both(...)
        local left, right = {}, {}
        for i, p in ipairs { ... } do
            left[i], right[select("#", ...) + 1 - i] = { p }, { { p[1], p[2], -p[3] } }
        end
        mesh:face(table.unpack(left))
        mesh:face(table.unpack(right))
    end
    local beak, neck, tail = { -0.62, 0.02, 0 }, { -0.25, 0.03, 0 }, { 0.45, 0, 0 }
    both(beak, { -0.25, 0.0, 0.05 }, neck)
    both(beak, { -0.25, -0.04, 0 }, { -0.25, 0.0, 0.05 })
    both(neck, { -0.25, 0.0, 0.05 }, { 0.0, -0.02, 0.1 }, { 0.0, 0.07, 0 })
    both({ -0.25, 0.0, 0.05 }, { -0.25, -0.04, 0 }, { 0.0, -0.1, 0 }, { 0.0, -0.02, 0.1 })
    both({ 0.0, 0.07, 0 }, { 0.0, -0.02, 0.1 }, tail)
    both({ 0.0, -0.02, 0.1 }, { 0.0, -0.1, 0 }, tail)
    both({ -0.14, 0.04, 0.05 }, { 0.16, 0.04, 0.05 }, { 0.1, 0.3, 0.5 }, { -0.16, 0.32, 0.48 })
    both({ -0.16, 0.32, 0.48 }, { 0.1, 0.3, 0.5 }, { 0.16, 0.28, 1.02 })
    mesh:write(path)
end

local final = here .. "../final/"
island(final .. "island.obj", { 6, -12 }, { 24, 13 }, 0.9, 44, 101)
island(final .. "islet.obj", { 0, 0 }, { 5.2, 3.4 }, 0.7, 30, 131)
base(final .. "base.obj", 6.75, 5.45, 0.62, -0.7, 0.3)
lake(final .. "lake.obj")
leaves(final .. "leaves.obj", final .. "fallen_leaf.obj")
goose(final .. "goose.obj")
conifer(final .. "conifer.obj")
crown(final .. "crown.obj")
