-- A cone on its base, and one on its tip that shows its base.
dofile 'lib/stage.lua'
local turned = gr.cone('turned')
turned:rotate('x', 180)
show(place(gr.cone('cone'), red, 1.3, 0, -0.6, 0.3, -0.6), place(turned, blue, 0.6, 0, 0.7, -1, 0.5))
