-- The Golden Pavilion on its lake at evening: three storeys under two tiled roofs with a phoenix on top, a maple from
-- an L-system on the left, an umbrella afloat on the right, fractal mountains behind.
--   rt temple.lua            gives temple.png
--   rt temple.lua -- side    gives temple_side.png, seen from the right
local build = require "build"
local landscape = require "landscape"
local pavilion = require "pavilion"
local umbrella = require "umbrella"

local scene = gr.node("scene")

build.place(scene, pavilion.make(), 0, 0, 0, -26)
scene:add_child(landscape.island())
scene:add_child(landscape.mountains())
scene:add_child(landscape.woods())
scene:add_child(landscape.geese(6, 31, -50))
scene:add_child(landscape.fallen_leaves())
build.place(scene, landscape.islet(), -15, 0, 17, 0)

-- The umbrella has fallen in upside down.
local umbrella_x, umbrella_z = 6.8, 33
local floating = umbrella.make()
floating:rotate("z", 180)
floating:rotate("y", 25)
floating:rotate("z", -17)
floating:rotate("x", 10)
floating:scale(2, 2, 2)
floating:translate(umbrella_x, 1.2, umbrella_z)
scene:add_child(floating)

-- Ripples spread from the temple's foot.
scene:add_child(landscape.lake(1, 8, 1.5, 70, 0.009))

local sun = gr.light({ -20, 110, 300 }, { 0.80, 0.70, 0.55 }, { 1, 0, 0 })
local sky = gr.light({ 220, 120, 160 }, { 0.20, 0.18, 0.26 }, { 1, 0, 0 })

local views = {
    front = { file = "temple.png", eye = { -1, 3.6, 62 }, direction = { 0.01, 0.008, -1 }, fov = 36 },
    side = { file = "temple_side.png", eye = { 30, 6, 36 }, direction = { -31.5, 0.6, -35.5 }, fov = 38 },
}
local view = assert(views[arg[1] or "front"], "the view is front or side")

gr.render(scene, view.file, 1024, 1024, view.eye, view.direction, { 0, 1, 0 }, view.fov, { 0.34, 0.32, 0.36 },
    { sun, sky })
