-- Three flowers from one stochastic grammar: only their seeds differ. Every stem bears a leaf; a bloom is a ring of
-- petals round a yellow heart. They stand in vases made by CSG.
local stem_green = gr.material({ 0.26, 0.50, 0.16 }, { 0.15, 0.18, 0.10 }, 15)
local leaf_green = gr.material({ 0.32, 0.58, 0.18 }, { 0.15, 0.18, 0.10 }, 15)
local heart_yellow = gr.material({ 0.92, 0.72, 0.14 }, { 0.20, 0.20, 0.10 }, 15)

local function ellipsoid(material, sx, sy, sz)
    local node = gr.sphere("ellipsoid")
    node:set_material(material)
    node:scale(sx, sy, sz)
    return node
end

-- Drawn for every trunk symbol, which makes it some eight times as high as wide: the leaf must be made that much wider.
local function stem()
    local node = gr.node("stem")
    local stalk = gr.cylinder("stalk")
    stalk:set_material(stem_green)
    node:add_child(stalk)
    local leaf = ellipsoid(leaf_green, 0.5, 0.035, 0.16)
    leaf:translate(0.5, 0, 0)
    leaf:rotate("z", 34)
    leaf:scale(9, 1.2, 9)
    leaf:rotate("y", 77)
    node:add_child(leaf)
    return node
end

local function bloom(petal_material)
    local node = gr.node("bloom")
    local heart = ellipsoid(heart_yellow, 0.30, 0.30, 0.30)
    heart:translate(0, -0.5, 0)
    node:add_child(heart)
    for i = 1, 8 do
        local petal = ellipsoid(petal_material, 0.50, 0.07, 0.24)
        petal:translate(0.58, 0, 0)
        petal:rotate("z", i % 2 == 0 and 26 or 40)
        petal:translate(0, -0.7, 0)
        petal:rotate("y", 45 * i)
        node:add_child(petal)
    end
    return node
end

local function vase(material)
    local function ball(radius, height)
        return ellipsoid(material, radius, height, radius)
    end
    local neck = gr.cylinder("neck")
    neck:set_material(material)
    neck:scale(0.36, 0.5, 0.36)
    neck:translate(0, 0.9, 0)
    local bore = gr.cylinder("bore")
    bore:scale(0.28, 1, 0.28)
    bore:translate(0, 1, 0)
    local lip = gr.torus("lip", 0.16)
    lip:set_material(material)
    lip:scale(0.36, 0.36, 0.36)
    lip:translate(0, 1.38, 0)
    local foot = gr.cube("foot")
    foot:translate(-0.5, -1, -0.5)
    foot:scale(3, 1, 3)
    foot:translate(0, -0.75, 0)
    local belly = gr.diff("belly", gr.diff("hollow", ball(0.85, 1), ball(0.78, 0.93)), foot)
    return gr.union("vase", gr.diff("open vase", gr.union("solid", belly, neck), bore), lip)
end

local scene = gr.node("scene")

local plants = {
    { x = -3.0, seed = 9, petal = { 0.86, 0.30, 0.44 }, glaze = { 0.20, 0.34, 0.52 } },
    { x = 0.0, seed = 10, petal = { 0.92, 0.88, 0.82 }, glaze = { 0.55, 0.20, 0.16 } },
    { x = 3.0, seed = 11, petal = { 0.66, 0.44, 0.86 }, glaze = { 0.24, 0.44, 0.34 } },
}
for _, plant in ipairs(plants) do
    local petals = bloom(gr.material(plant.petal, { 0.15, 0.15, 0.15 }, 10))
    local flower = gr.tree("flower", "flower.grammar", 4, stem(), petals, plant.seed)
    flower:translate(plant.x, 0.6, 0)
    scene:add_child(flower)
    local pot = vase(gr.material(plant.glaze, { 0.5, 0.5, 0.5 }, 40))
    pot:translate(plant.x, 0.75, 0)
    scene:add_child(pot)
end

local table_top = gr.cube("table")
table_top:set_material(gr.reflective_material({ 0.32, 0.20, 0.14 }, { 0.2, 0.2, 0.2 }, 30, 0.2))
table_top:scale(40, 0.4, 16)
table_top:translate(-20, -0.4, -6)
scene:add_child(table_top)

local key = gr.light({ -10, 14, 18 }, { 0.78, 0.72, 0.62 }, { 1, 0, 0 })
local fill = gr.light({ 14, 8, 10 }, { 0.24, 0.24, 0.32 }, { 1, 0, 0 })

gr.render(scene, "flower.png", 512, 512, { 0, 4.4, 24 }, { 0, -0.04, -1 }, { 0, 1, 0 }, 25, { 0.28, 0.28, 0.30 },
    { key, fill })
