-- Cone, sphere, cylinder, torus and cube hover over a lake whose circular waves break up their mirror images.
local gold = gr.material({ 0.88, 0.64, 0.22 }, { 0.5, 0.45, 0.3 }, 30)
local coral = gr.material({ 0.86, 0.34, 0.24 }, { 0.4, 0.4, 0.4 }, 30)
local pearl = gr.material({ 0.80, 0.76, 0.72 }, { 0.4, 0.4, 0.4 }, 30)

local scene = gr.node("scene")

local function put(node, material, x, y, z)
    node:set_material(material)
    node:translate(x, y, z or 0)
    scene:add_child(node)
end

local cone = gr.cone("cone")
cone:scale(1, 2, 1)
put(cone, coral, -5.4, 2.6)

local cube = gr.cube("cube")
cube:translate(-0.5, -0.5, -0.5)
cube:rotate("y", 35)
cube:scale(1.5, 1.5, 1.5)
put(cube, pearl, -2.8, 1.5)

put(gr.sphere("sphere"), gold, 0, 1.7)

local ring = gr.torus("torus", 0.35)
ring:rotate("x", 75)
ring:rotate("y", 20)
ring:scale(0.8, 0.8, 0.8)
put(ring, pearl, 2.8, 1.7)

local cylinder = gr.cylinder("cylinder")
cylinder:scale(0.8, 1, 0.8)
put(cylinder, coral, 5.4, 1.7)

-- Scaled up far more sideways than upwards, the waves become ripples.
local lake = gr.mesh("lake", "../waves/pool.obj")
lake:set_material(gr.reflective_material({ 0.14, 0.30, 0.52 }, { 0.3, 0.3, 0.3 }, 50, 0.65))
lake:mesh_add_bumps({ 0.5, 0.5 }, 40, 0.011)
lake:scale(60, 2.6, 60)
scene:add_child(lake)

local key = gr.light({ -20, 24, 30 }, { 0.78, 0.72, 0.62 }, { 1, 0, 0 })
local fill = gr.light({ 30, 12, 20 }, { 0.22, 0.22, 0.30 }, { 1, 0, 0 })

gr.render(scene, "primitives_reflecting.png", 512, 512, { 0, 3.2, 19 }, { 0, -0.08, -1 }, { 0, 1, 0 }, 40,
    { 0.28, 0.28, 0.32 }, { key, fill })
