-- Five golden spheres over a chequered floor: the share of mirrored light grows from 0 on the left to 1 on the right.
-- The coloured columns that they mirror stand behind the viewer.
local scene = gr.node("scene")

for i = 0, 4 do
    local sphere = gr.sphere("sphere")
    sphere:set_material(gr.reflective_material({ 0.85, 0.60, 0.20 }, { 0.60, 0.55, 0.40 }, 40, i / 4))
    sphere:translate(2.35 * (i - 2), 1.2, 0)
    scene:add_child(sphere)
end

local tiles = {
    gr.reflective_material({ 0.62, 0.58, 0.50 }, { 0.1, 0.1, 0.1 }, 20, 0.12),
    gr.reflective_material({ 0.16, 0.30, 0.26 }, { 0.1, 0.1, 0.1 }, 20, 0.12),
}
local function tile(x, z, material)
    local square = gr.mesh("tile", { { 0, 0, 0 }, { 0, 0, 1 }, { 1, 0, 1 }, { 1, 0, 0 } }, { { 0, 1, 2, 3 } })
    square:set_material(material)
    square:scale(1.5, 1, 1.5)
    square:translate(x, 0, z)
    return square
end
for i = -16, 15 do
    for j = -16, 13 do
        scene:add_child(tile(1.5 * i, 1.5 * j, tiles[(i + j) % 2 + 1]))
    end
end

-- A hue from 0 to 1 as a soft colour.
local function hue(h)
    local function channel(shift)
        return 0.5 + 0.4 * math.cos(2 * math.pi * (h + shift))
    end
    return { channel(0), channel(-1 / 3), channel(1 / 3) }
end

local columns = 13
for i = 1, columns do
    local angle = math.rad(180 * (i - 1) / (columns - 1))
    local column = gr.cylinder("column")
    column:set_material(gr.material(hue(i / columns), { 0.2, 0.2, 0.2 }, 10))
    column:scale(0.6, 5, 0.6)
    column:translate(10 * math.cos(angle), 5, 9 + 10 * math.sin(angle))
    scene:add_child(column)
end

local key = gr.light({ -6, 14, 10 }, { 0.75, 0.72, 0.66 }, { 1, 0, 0 })
local fill = gr.light({ 6, 9, 8 }, { 0.22, 0.22, 0.26 }, { 1, 0, 0 })

gr.render(scene, "reflection.png", 512, 512, { 0, 2.4, 15 }, { 0, -0.05, -1 }, { 0, 1, 0 }, 45, { 0.28, 0.28, 0.30 },
    { key, fill })
