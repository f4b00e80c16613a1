-- The three storeys: a terrace with its railing, posts, and walls of panels, one bay beside the other.
-- Every storey stands on y = 0 and is centred on the origin; its front looks to +z.
local build = require "build"
local material = require "materials"
local panel = require "panel"
local railing = require "railing"

local floor = {}

-- Half-widths of the walls, and heights. Terraces reach `terrace` beyond the walls and are `slab` thick.
floor.lower = { x = 5.1, z = 3.8, bays_x = 6, bays_z = 4, height = 2.85, terrace = 1.25, slab = 0.18 }
floor.upper = { x = 2.55, z = 2.55, bays_x = 3, bays_z = 3, height = 2.15, terrace = 0.72, slab = 0.16 }

-- A slab with a darker edge beam below it.
local function terrace(size, slab_material, edge_material)
    local x, z = size.x + size.terrace, size.z + size.terrace
    return build.group("terrace", {
        build.box("slab", slab_material, { -x, -0.08, -z }, { x, 0, z }),
        build.box("edge", edge_material, { -x + 0.06, -size.slab, -z + 0.06 }, { x - 0.06, -0.08, z - 0.06 }),
    })
end

-- Beams (nageshi) that run round the walls at height y.
local function beam(group, size, y, thickness, beam_material)
    local reach = 0.1
    build.four_sides(size.x, size.z, function(turn, half, out)
        local side = gr.node("beam side")
        side:add_child(build.box("beam", beam_material, { -half - reach, y, out - reach },
            { half - reach, y + thickness, out + reach }))
        side:rotate("y", turn)
        group:add_child(side)
    end)
end

-- Posts between the bays, and the bays themselves: bay(turn, i, count, width) gives the node for the i-th of `count`
-- bays of a side, its lower left corner at the origin.
local function walls(size, post_material, bay)
    local group = gr.node("walls")
    local post = build.column("post", post_material, 0.13, 0, 0, size.height, 0)
    build.four_sides(size.x, size.z, function(turn, half, out)
        local count = turn % 180 == 0 and size.bays_x or size.bays_z
        local width = 2 * half / count
        local side = gr.node("wall")
        for i = 1, count do
            local x = -half + (i - 1) * width
            build.place(side, post, x, 0, out)
            build.place(side, bay(turn, i, count, width), x, 0, out)
        end
        side:rotate("y", turn)
        group:add_child(side)
    end)
    return group
end

-- Makes each kind of node once for each width.
local function memo(make)
    local made = {}
    return function(width)
        local key = ("%.6f"):format(width)
        made[key] = made[key] or make(width)
        return made[key]
    end
end

-- Stacks nodes: {node, y} pairs.
local function stack(parts)
    local group = gr.node("bay")
    for _, part in ipairs(parts) do
        build.place(group, part[1], 0, part[2], 0)
    end
    return group
end

-- Bracket blocks on the posts, which carry the eaves.
local function brackets(size, bracket_material)
    local group = gr.node("brackets")
    local block = build.group("bracket", {
        build.box("bearing", bracket_material, { -0.16, -0.16, -0.16 }, { 0.16, 0, 0.16 }),
        build.box("arm", bracket_material, { -0.42, 0, -0.09 }, { 0.42, 0.13, 0.09 }),
        build.box("arm", bracket_material, { -0.09, 0.01, -0.1 }, { 0.09, 0.12, 0.62 }),
        build.box("block", bracket_material, { -0.12, 0.12, 0.36 }, { 0.12, 0.27, 0.6 }),
    })
    build.four_sides(size.x, size.z, function(turn, half, out)
        local count = turn % 180 == 0 and size.bays_x or size.bays_z
        local side = gr.node("bracket side")
        for i = 0, count do
            build.place(side, block, -half + 2 * half * i / count, size.height, out)
        end
        side:rotate("y", turn)
        group:add_child(side)
    end)
    return group
end

-- The four pillars of the front veranda, each on a stone, with a beam over them.
local function pillars(size)
    local group = gr.node("pillars")
    local pillar = build.group("pillar", {
        build.column("shaft", material.grained_wood, 0.17, 0, 0.1, size.height - 0.3, 0),
        build.column("foot", material.stone, 0.27, 0, 0, 0.1, 0),
        build.box("head", material.wood, { -0.26, size.height - 0.42, -0.24 }, { 0.26, size.height - 0.3, 0.24 }),
    })
    local z = size.z + size.terrace - 0.34
    for i = 0, 3 do
        build.place(group, pillar, size.x * (2 * i / 3 - 1), 0, z)
    end
    group:add_child(build.box("beam", material.wood, { -size.x - 0.5, size.height - 0.3, z - 0.12 },
        { size.x + 0.5, size.height - 0.04, z + 0.12 }))
    return group
end

-- First storey: plain wood, paper screens and white plaster. Its front is an open veranda behind four pillars.
function floor.first()
    local size = floor.lower
    local group = gr.node("first storey")
    local lattice = memo(function(w) return panel.framed(w, 0.85, material.wood, material.dark_wood, { 10, 5 }) end)
    local screen = memo(function(w) return panel.framed(w, 1.2, material.wood, material.paper, { 5, 4 }) end)
    local transom = memo(function(w) return panel.framed(w, 0.55, material.wood, material.plaster, { 2, 1 }) end)
    local boards = memo(function(w) return panel.framed(w, 2.05, material.wood, material.dark_wood, { 4, 1 }) end)
    local screened = memo(function(w) return stack { { lattice(w), 0.1 }, { screen(w), 0.95 }, { transom(w), 2.25 } } end)
    local boarded = memo(function(w) return stack { { boards(w), 0.1 }, { transom(w), 2.25 } } end)
    group:add_child(terrace(size, material.wood, material.dark_wood))
    group:add_child(walls(size, material.wood, function(turn, i, count, width)
        local closed = turn % 180 ~= 0 and (i == 1 or i == count)
        return closed and boarded(width) or screened(width)
    end))
    beam(group, size, -0.02, 0.12, material.wood)
    beam(group, size, 2.12, 0.14, material.wood)
    group:add_child(pillars(size))
    local rails = railing.around(size.x + size.terrace - 0.12, size.z + size.terrace - 0.12, material.wood,
        material.dark_gold, { [0] = true })
    group:add_child(rails)
    return group
end

-- Second storey: the same plan, covered with gold leaf.
function floor.second()
    local size = floor.lower
    local group = gr.node("second storey")
    local sill = memo(function(w) return panel.framed(w, 0.75, material.dark_gold, material.gold_leaf, { 1, 1 }) end)
    local shutter = memo(function(w) return panel.framed(w, 1.3, material.dark_gold, material.gold, { 8, 7 }, 0.035) end)
    local leaf = memo(function(w)
        local wing = panel.framed(w / 2, 1.3, material.dark_gold, material.gold_leaf, { 1, 3 }, 0.06)
        local door = gr.node("door")
        build.place(door, wing, 0, 0, 0)
        build.place(door, wing, w / 2, 0, 0)
        return door
    end)
    local transom = memo(function(w) return panel.framed(w, 0.55, material.dark_gold, material.gold_leaf, { 3, 1 }) end)
    local shuttered = memo(function(w) return stack { { sill(w), 0.1 }, { shutter(w), 0.85 }, { transom(w), 2.25 } } end)
    local doored = memo(function(w) return stack { { sill(w), 0.1 }, { leaf(w), 0.85 }, { transom(w), 2.25 } } end)
    group:add_child(terrace(size, material.gold, material.dark_gold))
    group:add_child(walls(size, material.gold, function(_, i, count, width)
        local middle = math.abs(i - (count + 1) / 2) < 1
        return middle and doored(width) or shuttered(width)
    end))
    beam(group, size, -0.02, 0.12, material.gold)
    beam(group, size, 2.12, 0.14, material.gold)
    group:add_child(brackets(size, material.dark_gold))
    group:add_child(railing.around(size.x + size.terrace - 0.12, size.z + size.terrace - 0.12, material.gold,
        material.bronze))
    return group
end

-- Third storey: a square hall with a folding door between two cusped windows on each side, all in gold.
function floor.third()
    local size = floor.upper
    local group = gr.node("third storey")
    local window = memo(function(w)
        return panel.cusped_window(w, 1.6, material.dark_gold, material.gold, material.paper)
    end)
    local door = memo(function(w)
        local wing = panel.framed(w / 2, 1.6, material.dark_gold, material.gold_leaf, { 1, 4 }, 0.06)
        local group = gr.node("door")
        build.place(group, wing, 0, 0, 0)
        build.place(group, wing, w / 2, 0, 0)
        return group
    end)
    local transom = memo(function(w) return panel.framed(w, 0.4, material.dark_gold, material.gold_leaf, { 4, 1 }) end)
    local windowed = memo(function(w) return stack { { window(w), 0.1 }, { transom(w), 1.75 } } end)
    local doored = memo(function(w) return stack { { door(w), 0.1 }, { transom(w), 1.75 } } end)
    group:add_child(terrace(size, material.gold, material.dark_gold))
    group:add_child(walls(size, material.gold, function(_, i, _, width)
        return i == 2 and doored(width) or windowed(width)
    end))
    beam(group, size, -0.02, 0.12, material.gold)
    beam(group, size, 1.66, 0.12, material.gold)
    group:add_child(brackets(size, material.dark_gold))
    group:add_child(railing.around(size.x + size.terrace - 0.1, size.z + size.terrace - 0.1, material.gold,
        material.bronze))
    return group
end

return floor
