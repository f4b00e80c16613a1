-- Combinations of cones, a sphere and a leaning cylinder. The columns combine cone and sphere: intersection, union,
-- sphere without cone, cone without sphere, and a double cone within the sphere. The rows combine that with the
-- cylinder: alone, united, intersected, without the cylinder, and the cylinder without it.
local orange = gr.material({ 0.92, 0.50, 0.12 }, { 0.35, 0.35, 0.30 }, 25)
local ivory = gr.material({ 0.82, 0.78, 0.84 }, { 0.40, 0.40, 0.40 }, 30)
local rose = gr.material({ 0.82, 0.18, 0.55 }, { 0.40, 0.40, 0.40 }, 30)

-- Its apex up if it is turned by 0, or nearer the middle and turned over by 180.
local function cone(turn)
    local node = gr.cone("cone")
    node:set_material(orange)
    node:scale(1.05, 1.25, 1.05)
    node:translate(0, turn and 0.12 or 0.35, 0)
    node:rotate("x", turn or 0)
    return node
end

local function sphere()
    local node = gr.sphere("sphere")
    node:set_material(ivory)
    node:scale(0.82, 0.82, 0.82)
    return node
end

local function cylinder()
    local node = gr.cylinder("cylinder")
    node:set_material(rose)
    node:scale(0.36, 1.2, 0.36)
    node:rotate("z", 42)
    return node
end

local columns = {
    function() return gr.intersect("both", cone(), sphere()) end,
    function() return gr.union("either", cone(), sphere()) end,
    function() return gr.diff("sphere without cone", sphere(), cone()) end,
    function() return gr.diff("cone without sphere", cone(), sphere()) end,
    function() return gr.intersect("hourglass", gr.union("double cone", cone(0), cone(180)), sphere()) end,
}

local rows = {
    function(solid) return solid end,
    function(solid) return gr.union("with the cylinder", solid, cylinder()) end,
    function(solid) return gr.intersect("within the cylinder", solid, cylinder()) end,
    function(solid) return gr.diff("without the cylinder", solid, cylinder()) end,
    function(solid) return gr.diff("rest of the cylinder", cylinder(), solid) end,
}

local scene = gr.node("scene")
for j, row in ipairs(rows) do
    for i, column in ipairs(columns) do
        local solid = row(column())
        solid:rotate("x", -20)
        solid:rotate("y", -24)
        solid:translate(2.6 * (i - 3), 2.55 * (3 - j), 0)
        scene:add_child(solid)
    end
end

local key = gr.light({ -15, 22, 30 }, { 0.75, 0.72, 0.68 }, { 1, 0, 0 })
local fill = gr.light({ 25, -10, 20 }, { 0.25, 0.25, 0.32 }, { 1, 0, 0 })

gr.render(scene, "csg_complex.png", 512, 512, { 0, 0, 40 }, { 0, 0, -1 }, { 0, 1, 0 }, 19.5, { 0.25, 0.25, 0.27 },
    { key, fill })
