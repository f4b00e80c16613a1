-- expect 1: tests/bad/negative_radius.lua:2: gr.nh_sphere: radius must be a positive number, but is -2
gr.nh_sphere('s', {0, 0, 0}, -2)
