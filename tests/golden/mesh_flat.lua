-- An octahedron without normals: flat faces. Quads, negative indices, groups and a `\` in the file.
dofile 'lib/stage.lua'
show(place(gr.mesh('octahedron', 'octahedron.obj'), red, 1, 20, -0.9, 0, 0), place(gr.mesh('box', 'box.obj'), green, 0.5, 35, 1, -0.5, 0.3))
