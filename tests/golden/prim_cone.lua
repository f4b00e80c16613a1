-- A cone on its base, and one on its tip that shows its base.
dofile 'lib/stage.lua'
local turned = gr.cone('turned')
turned:rotate('x', 180)
show(place(gr.cone('cone'), red, 1.5, 0, -0.8, 0.5, -0.4), place(turned, blue, 0.8, 0, 0.9, -1, 0.3))
