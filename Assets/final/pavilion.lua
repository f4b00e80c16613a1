-- The whole temple: base, three storeys, two roofs and the phoenix. Stands on y = 0, its front looks to +z.
local build = require "build"
local material = require "materials"
local floor = require "floor"
local roof = require "roof"

local pavilion = {}

-- Heights of what stands on what.
local first = 0.95
local second = first + floor.lower.height + floor.lower.slab
local lower_eaves = second + 2.5
local third = second + 4.6
local upper_eaves = 2.0                  -- above the third storey's floor
local top = upper_eaves + 2.45

-- The stone base in the water and the floor joists on it.
local function base()
    local size = floor.lower
    local x, z = size.x + size.terrace + 0.35, size.z + size.terrace + 0.35
    local group = gr.node("base")
    group:add_child(build.mesh("stones", "base.obj", material.stones))
    local post = build.column("stump", material.dark_wood, 0.12, 0, 0.45, 0.8, 0)
    for i = 0, 8 do
        for _, side in ipairs { -1, 1 } do
            build.place(group, post, (x - 0.75) * (i / 4 - 1), 0, side * (z - 0.75))
        end
    end
    return group
end

-- A square pedestal, a bowl and the phoenix.
local function ornament()
    local phoenix = build.mesh("phoenix", "phoenix.obj", material.bronze)
    phoenix:scale(1.25, 1.25, 1.25)
    phoenix:rotate("y", -35)
    phoenix:translate(0, 0.62, 0)
    local bowl = gr.sphere("bowl")
    bowl:set_material(material.bronze)
    bowl:scale(0.26, 0.16, 0.26)
    bowl:translate(0, 0.48, 0)
    return build.group("ornament", {
        build.box("plinth", material.dark_gold, { -0.42, -0.2, -0.42 }, { 0.42, 0.16, 0.42 }),
        build.box("pedestal", material.bronze, { -0.3, 0.16, -0.3 }, { 0.3, 0.38, 0.3 }),
        bowl, phoenix,
    })
end

-- The third storey with the upper roof and the phoenix, standing on y = 0.
function pavilion.third_storey()
    local group = gr.node("third storey")
    group:add_child(floor.third())
    build.place(group, roof.make("upper", floor.upper.z), 0, upper_eaves, 0)
    build.place(group, ornament(), 0, top, 0)
    return group
end

function pavilion.make()
    local group = gr.node("pavilion")
    group:add_child(base())
    build.place(group, floor.first(), 0, first, 0)
    build.place(group, floor.second(), 0, second, 0)
    build.place(group, roof.make("lower", floor.lower.z), 0, lower_eaves, 0)
    build.place(group, pavilion.third_storey(), 0, third, 0)
    return group
end

return pavilion
