-- The scene of snowman.lua as it is written today: the last transform is written last.
local white = gr.material({0.9, 0.9, 0.9}, {0.2, 0.2, 0.2}, 10)
local root = gr.node('root')
for i, size in ipairs {1.2, 0.8, 0.5} do
  local ball = gr.sphere('ball' .. i)
  ball:set_material(white)
  ball:scale(size, size * 0.9 ^ 2, size)
  ball:rotate('z', 30)
  ball:translate(0, 1.6 * (i - 1), 0)
  root:add_child(ball)
end
local nose = gr.cone('nose')
nose:set_material(gr.material({0.9, 0.4, 0.1}, {0, 0, 0}, 1))
nose:scale(0.15, 0.6, 0.15)
nose:rotate('x', 90)
nose:translate(0, 3.2, 1)
root:add_child(nose)
for _, x in ipairs {-0.2, 0.2} do
  local eye = gr.sphere('eye')
  eye:set_material(gr.material({0, 0, 0}, {0.5, 0.5, 0.5}, 20))
  eye:scale(0.06, 0.06, 0.06)
  eye:translate(x, 3.4, 0.45)
  root:add_child(eye)
end
gr.render(root, 'snowman.png', 96, 96, {0, 1.5, 9}, {0, 0, -1}, {0, 1, 0}, 45, {0.3, 0.3, 0.3},
          {gr.light({4, 8, 6}, {0.7, 0.7, 0.7}, {1, 0, 0})})
