-- A ring that lies and a ring that stands.
dofile 'lib/stage.lua'
local standing = gr.torus('standing', 0.25)
standing:rotate('x', 90)
show(place(gr.torus('lying', 0.3), green, 1, 0, 0, -0.7, 0), place(standing, red, 0.6, 30, 0, 0.1, 0))
