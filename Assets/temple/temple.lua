-- The temple alone: three storeys, two curved tiled roofs and the phoenix on top.
local pavilion = dofile("../final/pavilion.lua")

local temple = pavilion.make()
temple:rotate("y", -32)

local sun = gr.light({ -20, 110, 300 }, { 0.80, 0.70, 0.55 }, { 1, 0, 0 })
local sky = gr.light({ 220, 120, 160 }, { 0.22, 0.20, 0.26 }, { 1, 0, 0 })

gr.render(temple, "temple.png", 512, 512, { 0, 9, 50 }, { 0, -0.03, -1 }, { 0, 1, 0 }, 24, { 0.34, 0.32, 0.36 },
    { sun, sky })
