-- A gallery: the other scenes' pictures hang framed on its walls; on plinths before them stand a textured cylinder,
-- sphere, cube, cone and torus.
local scene = gr.node("scene")

local white = gr.material({ 0.8, 0.8, 0.8 }, { 0, 0, 0 }, 1)
local glossy = gr.material({ 0.8, 0.8, 0.8 }, { 0.3, 0.3, 0.3 }, 30)
local gilt = gr.material({ 0.74, 0.52, 0.18 }, { 0.5, 0.45, 0.3 }, 25)
local oak = gr.material({ 0.30, 0.19, 0.11 }, { 0.1, 0.1, 0.1 }, 10)
local marble = gr.material({ 0.70, 0.68, 0.66 }, { 0.2, 0.2, 0.2 }, 20)

local function textured(node, material, picture)
    node:set_material(material)
    node:add_texture(picture)
    return node
end

local function box(material, low, high)
    local node = gr.cube("box")
    node:set_material(material)
    node:scale(high[1] - low[1], high[2] - low[2], high[3] - low[3])
    node:translate(low[1], low[2], low[3])
    return node
end

-- A picture of the given width and height, its middle at the origin, facing +z, in a frame of two mouldings.
local function framed(picture, width, height)
    local group = gr.node("framed picture")
    local canvas = textured(gr.mesh("canvas", "canvas.obj"), white, picture)
    canvas:scale(width, height, 1)
    group:add_child(canvas)
    local function moulding(material, inner, thick, depth)
        local x, y = width / 2 + inner, height / 2 + inner
        group:add_child(box(material, { -x - thick, y, -0.02 }, { x + thick, y + thick, depth }))
        group:add_child(box(material, { -x - thick, -y - thick, -0.02 }, { x + thick, -y, depth }))
        group:add_child(box(material, { -x - thick, -y, -0.02 }, { -x, y, depth }))
        group:add_child(box(material, { x, -y, -0.02 }, { x + thick, y, depth }))
    end
    moulding(gilt, 0, 0.08, 0.06)
    moulding(oak, 0.08, 0.1, 0.12)
    return group
end

local function hang(picture, size, x, y, z, turn)
    local painting = framed(picture, size, size)
    painting:rotate("y", turn)
    painting:translate(x, y, z)
    scene:add_child(painting)
end

-- The room is 9.6 wide, 5.6 high and 12 deep; its back wall is at z = -6.
local half = 4.8

local function surface(file, picture, sx, sy, place)
    local node = textured(gr.mesh("surface", file), white, picture)
    node:scale(sx, sy, 1)
    place(node)
    scene:add_child(node)
end

surface("wall.obj", "damask.png", 2 * half, 5.6, function(wall) wall:translate(0, 2.8, -6) end)
for _, side in ipairs { -1, 1 } do
    surface("wall.obj", "damask.png", 12, 5.6, function(wall)
        wall:rotate("y", -90 * side)
        wall:translate(half * side, 2.8, 0)
    end)
    scene:add_child(box(oak, { side * half - 0.06, 0, -6 }, { side * half + 0.06, 0.3, 6 }))
    scene:add_child(box(oak, { side * half - 0.2, 5.5, -6 }, { side * half + 0.2, 5.75, 6 }))
end
scene:add_child(box(oak, { -half, 0, -6.1 }, { half, 0.3, -5.94 }))
scene:add_child(box(oak, { -half, 5.5, -6.2 }, { half, 5.74, -5.8 }))
surface("wall.obj", "parquet.png", 2 * half, 12, function(floor) floor:rotate("x", -90) end)

hang("../temple/temple.png", 2.6, 0, 3.3, -5.96, 0)
hang("../waves/waves_3.png", 2.0, -2.95, 3.3, -5.96, 0)
hang("../csg/csg_complex.png", 2.0, 2.95, 3.3, -5.96, 0)
hang("../tree/flower.png", 2.2, 0.04 - half, 3.3, -3.9, 90)
hang("../umbrella/umbrella.png", 2.2, half - 0.04, 3.3, -3.9, -90)

local function exhibit(node, x, z, height, lift)
    scene:add_child(box(marble, { x - 0.55, 0, z - 0.55 }, { x + 0.55, height - 0.08, z + 0.55 }))
    scene:add_child(box(marble, { x - 0.62, height - 0.08, z - 0.62 }, { x + 0.62, height, z + 0.62 }))
    node:translate(x, height + lift, z)
    scene:add_child(node)
end

local tin = textured(gr.cylinder("tin"), glossy, "label.png")
tin:scale(0.42, 0.5, 0.42)
exhibit(tin, -3.1, -2.9, 1.0, 0.5)

local planet = textured(gr.sphere("planet"), glossy, "planet.png")
planet:scale(0.52, 0.52, 0.52)
planet:rotate("z", -18)
exhibit(planet, 0, -3.4, 0.9, 0.52)

local crate = textured(gr.cube("crate"), white, "crate.png")
crate:translate(-0.5, 0, -0.5)
crate:scale(0.8, 0.8, 0.8)
crate:rotate("y", 30)
exhibit(crate, 3.1, -2.9, 1.0, 0)

local cone = textured(gr.cone("cone"), glossy, "spiral.png")
cone:scale(0.42, 1.1, 0.42)
exhibit(cone, -1.65, -1.6, 0.8, 1.1)

local ring = textured(gr.torus("ring", 0.42), glossy, "scales.png")
ring:rotate("x", 70)
ring:scale(0.4, 0.4, 0.4)
exhibit(ring, 1.65, -1.6, 0.8, 0.57)

local lamp = gr.light({ 0, 7.5, 3.5 }, { 0.62, 0.58, 0.50 }, { 1, 0, 0 })
local window = gr.light({ -2.5, 4, 9 }, { 0.32, 0.32, 0.36 }, { 1, 0, 0 })

gr.render(scene, "art_gallery.png", 512, 512, { 0, 2.8, 7 }, { 0, -0.06, -1 }, { 0, 1, 0 }, 54, { 0.32, 0.32, 0.32 },
    { lamp, window })
