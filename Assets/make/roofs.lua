-- Makes the meshes of the two roofs and of a tile: lua5.4 Assets/make/roofs.lua
local here = arg[0]:match("^(.*/)") or ""
package.path = here .. "?.lua;" .. here .. "../final/?.lua;" .. package.path
local obj = require "obj"
local shapes = require "roof_shape"

local function sub(a, b)
    return { a[1] - b[1], a[2] - b[2], a[3] - b[3] }
end

local function cross(a, b)
    return { a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1] }
end

local function normalised(a)
    local l = math.sqrt(a[1] ^ 2 + a[2] ^ 2 + a[3] ^ 2)
    return { a[1] / l, a[2] / l, a[3] / l }
end

-- Turns about y by quarter * 90 degrees; the front (+z) comes to +x first.
local function turned(p, quarter)
    local x, y, z = p[1], p[2], p[3]
    for _ = 1, quarter do
        x, z = z, -x
    end
    return { x, y, z }
end

local function each_side(make)
    for quarter = 0, 3 do
        make(quarter, quarter % 2 + 1)
    end
end

-- The covering's normal by central differences.
local function normal(shape, axis, u, v)
    local h = 1e-4
    local du = sub(shape:point(axis, math.min(1, u + h), v), shape:point(axis, math.max(-1, u - h), v))
    local dv = sub(shape:point(axis, u, math.min(1, v + h)), shape:point(axis, u, math.max(0, v - h)))
    return normalised(cross(du, dv))
end

-- Columns are denser toward the corners, where the eave bends.
local function spread(i, n)
    local t = 2 * i / n - 1
    return t * (1.35 - 0.35 * t * t)
end

local function covering(shape, path)
    local mesh = obj.new("roof covering, made by make/roofs.lua")
    local nx, ny = 28, 9
    each_side(function(quarter, axis)
        mesh:grid(nx, ny, function(i, j)
            local u, v = spread(i, nx), j / ny
            return { turned(shape:point(axis, u, v), quarter), nil, turned(normal(shape, axis, u, v), quarter) }
        end)
    end)
    mesh:write(path)
end

-- The fascia below the covering's edge, in two steps, and the underside up to the inner edge.
local function eaves(shape, path)
    local mesh = obj.new("eaves, made by make/roofs.lua")
    local nx = 28
    local profile = {                       -- {v, below the covering}
        { 0, 0 }, { 0, 0.5 * shape.thickness }, { 0.015, 0.5 * shape.thickness }, { 0.015, shape.thickness },
        { 0.25, shape.thickness }, { 0.5, shape.thickness }, { 0.75, shape.thickness }, { 1, shape.thickness },
    }
    each_side(function(quarter, axis)
        mesh:grid(nx, #profile - 1, function(i, j)
            local p = profile[#profile - j]
            local point = shape:point(axis, spread(i, nx), p[1])
            point[2] = point[2] - p[2]
            return { turned(point, quarter) }
        end)
    end)
    mesh:write(path)
end

-- A half-round cap along each hip, growing toward the corner and ending in an upturned tip.
local function ridges(shape, path)
    local mesh = obj.new("hip ridges, made by make/roofs.lua")
    local around, steps = 6, 24
    for quarter = 0, 3 do
        local axis = quarter % 2 + 1
        local function middle(v)
            local p = shape:point(axis, 1, math.max(v, 0))
            if v < 0 then                   -- beyond the corner: on outward, and up
                local inner = shape:point(axis, 1, 0.02)
                for k = 1, 3 do
                    p[k] = p[k] + (p[k] - inner[k]) / 0.02 * -v
                end
                p[2] = p[2] + 60 * v * v
            end
            return p
        end
        local across = normalised({ shape:out(axis, 0), 0, -shape:half(axis, 0) })
        local function corner(i, j)
            local v = -0.06 + 1.06 * (1 - j / steps)
            local angle = math.pi * (-0.15 + 1.3 * i / around)
            local size = v < 0 and 0.17 * (1 + v / 0.062) or 0.15 + 0.02 * (1 - v)
            local p = middle(v)
            local c, s = math.cos(angle) * size, math.sin(angle) * size * 1.25
            return { turned({ p[1] - across[1] * c, p[2] + s + 0.03, p[3] - across[3] * c }, quarter) }
        end
        mesh:grid(around, steps, function(i, j) return corner(around - i, j) end)
    end
    mesh:write(path)
end

-- A half-round tile along z from 0 (upper, narrower end) to 1, of radius 1; its lower end is closed.
local function tile(path)
    local mesh = obj.new("roof tile, made by make/roofs.lua")
    local around = 5
    local function rim(i, z, radius)
        local angle = math.pi * i / around
        return { math.cos(angle) * radius, math.sin(angle) * radius, z }
    end
    mesh:grid(around, 1, function(i, j)
        local p = j == 0 and rim(i, 0, 0.8) or rim(i, 1, 1)
        return { p, nil, normalised({ p[1], p[2], 0 }) }
    end)
    for i = 1, around - 1 do
        mesh:face({ rim(0, 1, 1) }, { rim(i, 1, 1) }, { rim(i + 1, 1, 1) })
    end
    mesh:write(path)
end

for _, name in ipairs { "lower", "upper" } do
    local base = here .. "../final/" .. name
    covering(shapes[name], base .. "_roof.obj")
    eaves(shapes[name], base .. "_eaves.obj")
    ridges(shapes[name], base .. "_ridges.obj")
end
tile(here .. "../final/tile.obj")
