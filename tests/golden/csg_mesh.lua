-- Closed meshes as operands: an octahedron less a box, and a sphere less an octahedron.
dofile 'lib/stage.lua'
local a = gr.diff('notched', place(gr.mesh('octahedron', 'octahedron.obj'), red, 1, 0, 0, 0, 0),
                  place(gr.mesh('box', 'box.obj'), nil, 0.5, 0, 0.3, 0.4, 0.5))
local b = gr.diff('ball', place(gr.sphere('ball'), blue, 0.8, 0, 0, 0, 0), place(gr.mesh('octahedron', 'octahedron.obj'), nil, 0.9, 0, 0.3, 0.5, 0.4))
show(place(a, nil, 0.9, 15, -0.9, -0.1, 0), place(b, nil, 0.9, 0, 0.9, -0.3, 0))
