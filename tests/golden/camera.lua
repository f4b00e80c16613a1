-- A camera that is turned on its side, with an `up` that isn't perpendicular, a long `view` and a tall picture.
dofile 'lib/stage.lua'
local root = gr.node('root')
root:add_child(floor())
root:add_child(place(gr.cone('cone'), red, 1, 0, 0, 0, 0))
gr.render(root, 'golden.png', 64, 112, {1.5, 1, 4}, {-150, -100, -400}, {1, 0.2, 1}, 50, {0.3, 0.3, 0.3}, lights, {background = {0, 0.2, 0.1}})
