-- The evening gradient behind nothing at all, wide; row 0 is the top. No lights; render as a method.
gr.node('empty'):render('golden.png', 80, 48, {0, 0, 5}, {0, 0, -1}, {0, 1, 0}, 50, {1, 1, 1}, {})
