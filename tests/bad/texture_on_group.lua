-- expect 1: tests/bad/texture_on_group.lua:2: node:add_texture: 'g' is a group and has no surface of its own
gr.node('g'):add_texture('x.png')
