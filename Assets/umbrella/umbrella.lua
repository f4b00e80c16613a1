-- A paper umbrella as one CSG solid: bowl, scalloped rim, white band, struts, shaft and crook.
local umbrella = dofile("../final/umbrella.lua")

local scene = gr.node("scene")
local open_umbrella = umbrella.make()
open_umbrella:rotate("z", 14)
open_umbrella:rotate("x", 8)
open_umbrella:translate(-0.05, 0.2, 0)
scene:add_child(open_umbrella)

local key = gr.light({ -4, 6, 8 }, { 0.80, 0.76, 0.68 }, { 1, 0, 0 })
local fill = gr.light({ 8, -3, 5 }, { 0.30, 0.30, 0.38 }, { 1, 0, 0 })

gr.render(scene, "umbrella.png", 512, 512, { 0, 0, 6 }, { 0, 0, -1 }, { 0, 1, 0 }, 26, { 0.25, 0.25, 0.28 },
    { key, fill })
