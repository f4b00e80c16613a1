-- An octahedron without normals: flat faces. Quads, negative indices, groups and a `\` in the file.
dofile 'lib/stage.lua'
show(place(gr.mesh('octahedron', 'octahedron.obj'), red, 0.85, 20, -0.6, -0.1, 0), place(gr.mesh('box', 'box.obj'), green, 0.4, 35, 0.8, -0.6, 0.3))
