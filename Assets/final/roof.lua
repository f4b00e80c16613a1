-- The curved roofs: a mesh for the covering and one for the eaves' underside (made by Assets/make/roofs.lua), rows of
-- half-round tiles laid over the covering, and rafters under the eaves. Tiles and rafters are instances of one node.
local build = require "build"
local material = require "materials"
local shapes = require "roof_shape"

local roof = {}

-- The direction from point a to point b as two turns: about x (the slope) and about z (the sideways tilt).
local function slope_deg(a, b)
    return math.deg(math.atan(a[2] - b[2], b[3] - a[3]))
end

-- A node that carries `child` from its own frame (z from 0 to 1, y up) to the line from a (upper) to b (lower).
local function along_slope(child, width, height, a, b, tilt_deg)
    local length = math.sqrt((b[1] - a[1]) ^ 2 + (b[2] - a[2]) ^ 2 + (b[3] - a[3]) ^ 2)
    local node = gr.node("along slope")
    node:scale(width, height, length)
    node:rotate("z", tilt_deg)
    node:rotate("x", slope_deg(a, b))
    node:translate(a[1], a[2], a[3])
    node:add_child(child)
    return node
end

-- How far the surface tilts sideways at x.
local function tilt_deg(shape, axis, x, v)
    local step = 0.01
    local a, b = shape:point_at(axis, x - step, v), shape:point_at(axis, x + step, v)
    return math.deg(math.atan(b[2] - a[2], 2 * step))
end

-- One row of tiles from the eave up to the hip or the top edge. They lap over: the upper end of each is the narrower.
local function tile_row(group, shape, axis, x, tiles, radius, tile_length)
    local last = shape:hip(axis, x)
    local lower, upper = shape:point_at(axis, x, 0), shape:point_at(axis, x, last)
    local length = math.sqrt((upper[2] - lower[2]) ^ 2 + (upper[3] - lower[3]) ^ 2)
    local count = math.floor(length / tile_length + 0.5)
    for i = 1, count do
        local a, b = shape:point_at(axis, x, last * i / count), shape:point_at(axis, x, last * (i - 1) / count)
        local tilt = tilt_deg(shape, axis, x, last * (i - 0.5) / count)
        group:add_child(along_slope(tiles[math.random(#tiles)], radius, radius, a, b, tilt))
    end
end

local function tiled_side(shape, axis, tiles, spacing)
    local group = gr.node("tiled side")
    local half = shape.eave[axis]
    local count = math.floor(2 * half / spacing + 0.5)
    for i = 0, count - 1 do
        tile_row(group, shape, axis, -half + 2 * half * (i + 0.5) / count, tiles, 0.34 * spacing, 0.42)
    end
    return group
end

-- Rafters run below the covering from the wall (v = inner) to just behind the eave.
local function raftered_side(shape, axis, rafter, spacing, inner)
    local group = gr.node("raftered side")
    local half = shape.eave[axis] - 0.12
    local count = math.floor(2 * half / spacing + 0.5)
    for i = 0, count do
        local x = -half + 2 * half * i / count
        local first, last = 0.03, math.min(inner, shape:hip(axis, x))
        if last > first + 0.04 then
            local a, b = shape:point_at(axis, x, last), shape:point_at(axis, x, first)
            a[2], b[2] = a[2] - shape.thickness, b[2] - shape.thickness
            group:add_child(along_slope(rafter, 1, 1, a, b, 0))
        end
    end
    return group
end

-- Two instances of the side along x and two of the one along z.
local function on_four_sides(group, along_x, along_z)
    build.place(group, along_x, 0, 0, 0, 0)
    build.place(group, along_z, 0, 0, 0, 90)
    build.place(group, along_x, 0, 0, 0, 180)
    build.place(group, along_z, 0, 0, 0, 270)
end

-- Which v of the roof lies above a wall `z` from the middle.
local function above_wall(shape, z)
    return (shape.eave[2] - z) / (shape.eave[2] - shape.top[2])
end

-- The roof `name` ("lower" or "upper"), its eaves' middle at y = 0; wall: half-depth of the storey below.
function roof.make(name, wall)
    local shape = shapes[name]
    local group = gr.node(name .. " roof")
    group:add_child(build.mesh("covering", name .. "_roof.obj", material.roof))
    group:add_child(build.mesh("eaves", name .. "_eaves.obj", material.gold))
    group:add_child(build.mesh("ridges", name .. "_ridges.obj", material.tiles[2]))
    local tiles = {}
    for i, tile_material in ipairs(material.tiles) do
        tiles[i] = build.mesh("tile", "tile.obj", tile_material)
    end
    on_four_sides(group, tiled_side(shape, 1, tiles, 0.29), tiled_side(shape, 2, tiles, 0.29))
    local rafter = build.box("rafter", material.dark_gold, { -0.045, -0.1, 0 }, { 0.045, 0.02, 1 })
    local inner = math.min(1, above_wall(shape, wall) + 0.04)
    on_four_sides(group, raftered_side(shape, 1, rafter, 0.4, inner), raftered_side(shape, 2, rafter, 0.4, inner))
    return group
end

return roof
