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

-- Its railing; open: the turns of sides without one.
local function terrace_railing(size, rail_material, cap_material, open)
    local inset = 0.11
    local x, z = size.x + size.terrace - inset, size.z + size.terrace - inset
    return railing.around(x, z, rail_material, cap_material, open or {})
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

-- A kind of bay: panels over each other, `rows` from the bottom. The function that it returns gives the bay of a
-- certain width, made once. Of a row: y, height, frame, infill, fields and bar as for panel.framed; wings: so many
-- panels side by side; or `make`, a function that makes something else of the bay's width.
local function bay_kind(rows)
    local made = {}
    local function make(width)
        local group = gr.node("bay")
        for _, row in ipairs(rows) do
            local wings = row.wings or 1
            local part = row.make and row.make(width)
                or panel.framed(width / wings, row.height, row.frame, row.infill, row.fields, row.bar)
            for wing = 0, wings - 1 do
                build.place(group, part, wing * width / wings, row.y, 0)
            end
        end
        return group
    end
    return function(width)
        local key = ("%.6f"):format(width)
        made[key] = made[key] or make(width)
        return made[key]
    end
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
    local wood, dark = material.wood, material.dark_wood
    local transom = { y = 2.25, height = 0.55, frame = wood, infill = material.plaster, fields = { 2, 1 } }
    local screened = bay_kind {
        { y = 0.1, height = 0.85, frame = wood, infill = dark, fields = { 10, 5 } },
        { y = 0.95, height = 1.2, frame = wood, infill = material.paper, fields = { 5, 4 } },
        transom,
    }
    local boarded = bay_kind { { y = 0.1, height = 2.05, frame = wood, infill = dark, fields = { 4, 1 } }, transom }
    local group = gr.node("first storey")
    group:add_child(terrace(size, wood, dark))
    group:add_child(walls(size, wood, function(turn, i, count, width)
        local closed = turn % 180 ~= 0 and (i == 1 or i == count)
        return closed and boarded(width) or screened(width)
    end))
    beam(group, size, -0.02, 0.12, wood)
    beam(group, size, 2.12, 0.14, wood)
    group:add_child(pillars(size))
    group:add_child(terrace_railing(size, wood, material.dark_gold, { [0] = true }))
    return group
end

-- Second storey: the same plan, covered with gold leaf; doors in the middle of each side.
function floor.second()
    local size = floor.lower
    local gold, leaf, dark = material.gold, material.gold_leaf, material.dark_gold
    local sill = { y = 0.1, height = 0.75, frame = dark, infill = leaf, fields = { 1, 1 } }
    local transom = { y = 2.25, height = 0.55, frame = dark, infill = leaf, fields = { 3, 1 } }
    local shuttered = bay_kind {
        sill, { y = 0.85, height = 1.3, frame = dark, infill = gold, fields = { 8, 7 }, bar = 0.035 },
        transom,
    }
    local doored = bay_kind {
        sill, { y = 0.85, height = 1.3, frame = dark, infill = leaf, fields = { 1, 3 }, bar = 0.06, wings = 2 },
        transom,
    }
    local group = gr.node("second storey")
    group:add_child(terrace(size, gold, dark))
    group:add_child(walls(size, gold, function(_, i, count, width)
        local middle = math.abs(i - (count + 1) / 2) < 1
        return middle and doored(width) or shuttered(width)
    end))
    beam(group, size, -0.02, 0.12, gold)
    beam(group, size, 2.12, 0.14, gold)
    group:add_child(brackets(size, dark))
    group:add_child(terrace_railing(size, gold, material.bronze))
    return group
end

-- Third storey: a square hall with a folding door between two cusped windows on each side, all in gold.
function floor.third()
    local size = floor.upper
    local gold, leaf, dark = material.gold, material.gold_leaf, material.dark_gold
    local transom = { y = 1.75, height = 0.4, frame = dark, infill = leaf, fields = { 4, 1 } }
    local function window(width)
        return panel.cusped_window(width, 1.6, dark, gold, material.paper)
    end
    local windowed = bay_kind { { y = 0.1, make = window }, transom }
    local doored = bay_kind {
        { y = 0.1, height = 1.6, frame = dark, infill = leaf, fields = { 1, 4 }, bar = 0.06, wings = 2 },
        transom,
    }
    local group = gr.node("third storey")
    group:add_child(terrace(size, gold, dark))
    group:add_child(walls(size, gold, function(_, i, _, width)
        return i == 2 and doored(width) or windowed(width)
    end))
    beam(group, size, -0.02, 0.12, gold)
    beam(group, size, 1.66, 0.12, gold)
    group:add_child(brackets(size, dark))
    group:add_child(terrace_railing(size, gold, material.bronze))
    return group
end

return floor
