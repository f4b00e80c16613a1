-- The small framed panels of which all walls consist. Every panel stands with its lower left corner at the origin,
-- faces +z and is centred on z = 0.
local build = require "build"
local box = build.box

local panel = {}

local frame_width, frame_depth = 0.07, 0.11

local function frame(group, width, height, material)
    local d = frame_depth / 2
    group:add_child(box("left stile", material, { 0, 0, -d }, { frame_width, height, d }))
    group:add_child(box("right stile", material, { width - frame_width, 0, -d }, { width, height, d }))
    group:add_child(box("lower rail", material, { frame_width, 0, -d }, { width - frame_width, frame_width, d }))
    group:add_child(box("upper rail", material, { frame_width, height - frame_width, -d },
        { width - frame_width, height, d }))
end

-- Thin bars that part the frame's inside into columns x rows fields. The upright ones stand out a little further.
local function lattice(group, width, height, columns, rows, bar, material)
    local x0, y0, w, h = frame_width, frame_width, width - 2 * frame_width, height - 2 * frame_width
    for i = 1, columns - 1 do
        local x = x0 + w * i / columns
        group:add_child(box("bar", material, { x - bar / 2, y0, -0.040 }, { x + bar / 2, y0 + h, 0.040 }))
    end
    for j = 1, rows - 1 do
        local y = y0 + h * j / rows
        group:add_child(box("bar", material, { x0, y - bar / 2, -0.034 }, { x0 + w, y + bar / 2, 0.034 }))
    end
end

-- A frame with an infill and bars over it. fields: {columns, rows}, {1, 1} for none; bar: their width.
function panel.framed(width, height, frame_material, infill_material, fields, bar)
    local group = gr.node("panel")
    frame(group, width, height, frame_material)
    local w = frame_width
    group:add_child(box("infill", infill_material, { w, w, -0.02 }, { width - w, height - w, 0.02 }))
    lattice(group, width, height, fields[1], fields[2], bar or 0.03, frame_material)
    return group
end

local function operand(shape, material, scale, place)
    shape:set_material(material)
    shape:scale(table.unpack(scale))
    shape:translate(table.unpack(place))
    return shape
end

-- A cylinder along z, for carving.
local function drill(radius, x, y, material)
    local cylinder = gr.cylinder("drill")
    cylinder:set_material(material)
    cylinder:rotate("x", 90)
    cylinder:scale(radius, radius, 1)
    cylinder:translate(x, y, 0)
    return cylinder
end

-- A bell-shaped opening: a box below the pointed arch that two cylinders have in common.
local function bell(width, height, x, y, material)
    local radius = 1.1 * width
    local springing = y + height - math.sqrt(radius ^ 2 - (radius - width / 2) ^ 2)
    local arch = gr.intersect("arch", drill(radius, x - width / 2 + radius, springing, material),
        drill(radius, x + width / 2 - radius, springing, material))
    local lower = operand(gr.cube("opening"), material, { width, springing - y, 2 }, { x - width / 2, y, -1 })
    return gr.union("bell", lower, arch)
end

-- The cusped window (katomado) of Zen temples, cut out of a slab; its surround stands out of the wall.
function panel.cusped_window(width, height, frame_material, wall_material, infill_material)
    local group = gr.node("cusped window")
    frame(group, width, height, frame_material)
    local w = frame_width
    local x, y, opening_width, opening_height = width / 2, 0.32 * height, 0.56 * width, 0.58 * height
    local slab = operand(gr.cube("slab"), wall_material, { width - 2 * w, height - 2 * w, 0.05 }, { w, w, -0.02 })
    group:add_child(gr.diff("wall", slab, bell(opening_width, opening_height, x, y, wall_material)))
    local surround = gr.intersect("surround", bell(opening_width + 0.14, opening_height + 0.12, x, y - 0.06,
        frame_material), operand(gr.cube("depth"), frame_material, { width, height, 0.09 }, { 0, 0, -0.03 }))
    group:add_child(gr.diff("surround", surround, bell(opening_width, opening_height, x, y, frame_material)))
    group:add_child(box("infill", infill_material, { w, w, -0.05 }, { width - w, height - w, -0.03 }))
    for i = -2, 2 do
        local at = x + i * opening_width / 5
        group:add_child(box("bar", frame_material, { at - 0.015, 0.3 * height, -0.03 },
            { at + 0.015, 0.92 * height, -0.005 }))
    end
    return group
end

return panel
