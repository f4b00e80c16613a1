-- Four levels: a hollow half shell with a ring, holes and a ball inside; every operand has a matrix of its own.
dofile 'lib/stage.lua'
local shell = gr.diff('shell', place(gr.sphere('outer'), red, 1, 0, 0, 0, 0), place(gr.sphere('inner'), nil, 0.85, 0, 0, 0, 0))
local half = gr.difference('half', shell, gr.nh_box('front', {-2, 0.1, -2}, 4))
local hole = gr.cylinder('hole')
hole:rotate('z', 90)
hole:scale(3, 0.2, 0.2)
hole:rotate('y', 65)
hole:translate(0, -0.35, 0)
local bowl = gr.union('bowl', gr.diff('pierced', half, hole), place(gr.torus('rim', 0.1), blue, 0.92, 0, 0, 0.1, 0))
show_at({0.9, 3, 4.5}, {floor(), place(gr.union('all', bowl, place(gr.sphere('ball'), green, 0.4, 0, 0, -0.4, 0)), nil, 1, 0, 0, 0, 0)})
