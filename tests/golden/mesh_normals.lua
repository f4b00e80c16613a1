-- The same octahedron with normals at its corners: shaded as if it were round, its outline still pointed.
dofile 'lib/stage.lua'
show(place(gr.mesh('smooth', 'octahedron_vn.obj'), red, 1.1, 20, 0, 0.1, 0))
