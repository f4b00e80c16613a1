-- expect 1: tests/bad/infinity.lua:2: gr.nh_box: point[1] must be a finite number, but is -inf
gr.nh_box('b', {-1 / 0, 0, 0}, 1)
