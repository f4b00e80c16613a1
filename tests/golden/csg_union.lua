-- Cone, sphere and cylinder as one solid; each keeps its material.
dofile 'lib/stage.lua'
local post = gr.cylinder('post')
post:scale(0.35, 0.8, 0.35)
post:set_material(green)
local ball = place(gr.sphere('ball'), red, 0.6, 0, 0, 0.5, 0)
local hat = place(gr.cone('hat'), blue, 0.9, 0, 0, 1.5, 0)
show(place(gr.union('figure', gr.union('body', post, ball), hat), nil, 0.8, 0, 0, -0.3, 0))
