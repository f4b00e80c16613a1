-- The operations on two spheres, row by row: A - B, B - A, their intersection, their union.
local lilac = gr.material({ 0.80, 0.76, 0.86 }, { 0.40, 0.40, 0.40 }, 30)
local rose = gr.material({ 0.86, 0.22, 0.52 }, { 0.40, 0.40, 0.40 }, 30)

local function ball(material, x)
    local sphere = gr.sphere("ball")
    sphere:set_material(material)
    sphere:translate(x, 0, 0)
    return sphere
end

local function left()
    return ball(lilac, -0.45)
end

local function right()
    return ball(rose, 0.45)
end

local solids = {
    gr.diff("left without right", left(), right()),
    gr.diff("right without left", right(), left()),
    gr.intersect("both", left(), right()),
    gr.union("either", left(), right()),
}

local scene = gr.node("scene")
for i, solid in ipairs(solids) do
    solid:rotate("y", i == 2 and 35 or -35)
    solid:translate(2 * ((i - 1) % 2 == 0 and -0.85 or 0.85), i <= 2 and 1.45 or -1.45, 0)
    scene:add_child(solid)
end

local key = gr.light({ -6, 8, 12 }, { 0.75, 0.72, 0.68 }, { 1, 0, 0 })
local fill = gr.light({ 10, -4, 8 }, { 0.25, 0.25, 0.32 }, { 1, 0, 0 })

gr.render(scene, "csg_simple.png", 512, 512, { 0, 0, 14 }, { 0, 0, -1 }, { 0, 1, 0 }, 28, { 0.25, 0.25, 0.27 },
    { key, fill })
