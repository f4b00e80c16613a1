-- Every primitive on a plinth. Back: sphere, cube, cylinder, cone; front: three tori with a growing minor radius, the
-- last a spindle; nh_sphere and nh_box, which are placed when they are made.
local coral = gr.material({ 0.88, 0.36, 0.26 }, { 0.4, 0.4, 0.4 }, 30)
local ochre = gr.material({ 0.90, 0.66, 0.20 }, { 0.4, 0.4, 0.4 }, 30)
local teal = gr.material({ 0.12, 0.52, 0.52 }, { 0.4, 0.4, 0.4 }, 30)
local lilac = gr.material({ 0.62, 0.50, 0.82 }, { 0.4, 0.4, 0.4 }, 30)
local pale = gr.material({ 0.74, 0.70, 0.66 }, { 0.1, 0.1, 0.1 }, 10)
local ground = gr.material({ 0.34, 0.32, 0.36 }, { 0.1, 0.1, 0.1 }, 10)

local scene = gr.node("scene")

local function put(node, material, x, y, z)
    node:set_material(material)
    node:translate(x, y, z)
    scene:add_child(node)
end

local function plinth(x, z, height)
    local block = gr.cube("plinth")
    block:translate(-0.5, 0, -0.5)
    block:scale(2, height, 2)
    put(block, pale, x, 0, z)
end

local back, front = 1.6, 0.5
local function row(z, height, makers)
    for i, make in ipairs(makers) do
        local x = 2.7 * (i - (#makers + 1) / 2)
        plinth(x, z, height)
        make(x, height, z)
    end
end

row(-2, back, {
    function(x, y, z)
        put(gr.sphere("sphere"), coral, x, y + 1, z)
    end,
    function(x, y, z)
        local cube = gr.cube("cube")
        cube:translate(-0.5, 0, -0.5)
        cube:scale(1.4, 1.4, 1.4)
        cube:rotate("y", 35)
        put(cube, ochre, x, y, z)
    end,
    function(x, y, z)
        local cylinder = gr.cylinder("cylinder")
        cylinder:scale(0.75, 1, 0.75)
        put(cylinder, teal, x, y + 1, z)
    end,
    function(x, y, z)
        local cone = gr.cone("cone")
        cone:scale(0.85, 2, 0.85)
        put(cone, lilac, x, y + 2, z)
    end,
})

local function torus(minor, material)
    return function(x, y, z)
        local ring = gr.torus("torus", minor)
        local size = 0.95 / (1 + minor)
        ring:rotate("x", 65)
        ring:scale(size, size, size)
        put(ring, material, x, y + 0.95, z)
    end
end

-- A minor radius above the major one closes the hole.
local function spindle(x, y, z)
    local whole = gr.torus("spindle", 1.5)
    whole:set_material(lilac)
    local size = 0.95 / 2.5
    whole:scale(size, size, size)
    whole:rotate("x", 65)
    whole:translate(x, y + 0.8, z)
    scene:add_child(whole)
end

row(2.2, front, {
    torus(0.2, coral),
    torus(0.5, ochre),
    spindle,
    function(x, y, z)
        put(gr.nh_box("nh_box", { -0.7, 0, -0.7 }, 1), teal, x, y, z)
        put(gr.nh_sphere("nh_sphere", { 0.42, 0.45, 0.3 }, 0.45), coral, x, y, z)
    end,
})

local floor = gr.cube("floor")
floor:translate(-0.5, -1, -0.5)
floor:scale(60, 0.2, 40)
put(floor, ground, 0, 0, 0)

local key = gr.light({ -9, 14, 12 }, { 0.75, 0.72, 0.66 }, { 1, 0, 0 })
local fill = gr.light({ 12, 8, 10 }, { 0.25, 0.25, 0.32 }, { 1, 0, 0 })

gr.render(scene, "primitives.png", 512, 512, { 0, 9, 20 }, { 0, -0.39, -1 }, { 0, 1, 0 }, 31.5, { 0.28, 0.28, 0.30 },
    { key, fill })
