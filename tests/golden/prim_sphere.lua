-- A sphere on the floor: highlight at the upper right, shadow behind to the left.
dofile 'lib/stage.lua'
show(place(gr.sphere('ball'), red, 1, 0, 0, 0, 0))
