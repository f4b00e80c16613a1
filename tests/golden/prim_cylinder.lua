-- A standing and a lying cylinder: side, upper cap, end cap.
dofile 'lib/stage.lua'
local lying = gr.cylinder('lying')
lying:scale(1, 2, 1)
lying:rotate('z', 90)
show(place(gr.cylinder('standing'), blue, 0.5, 0, -0.8, -0.5, 0), place(lying, red, 0.35, 50, 0.6, -0.65, 0.5))
