-- A scene as they were written until 2015: transforms are post-multiplied, names are those of Lua 5.1.
local white = gr.material({0.9, 0.9, 0.9}, {0.2, 0.2, 0.2}, 10)
local root = gr.node('root')
local sizes = {1.2, 0.8, 0.5}
for i = 1, table.getn(sizes) do
  local ball = gr.sphere('ball' .. i)
  ball:set_material(white)
  ball:translate(0, 1.6 * (i - 1), 0)
  ball:rotate('Z', 30)
  ball:scale(sizes[i], sizes[i] * math.pow(0.9, 2), sizes[i])
  root:add_child(ball)
end
local nose = gr.cone('nose')
nose:set_material(gr.material({0.9, 0.4, 0.1}, unpack({{0, 0, 0}, 1})))
nose:translate(0, 3.2, 1)
nose:rotate('X', 90)
nose:scale(0.15, 0.6, 0.15)
root:add_child(nose)
for word in string.gfind('left right', '%a+') do
  local eye = gr.sphere(word)
  eye:set_material(gr.material({0, 0, 0}, {0.5, 0.5, 0.5}, 20))
  eye:translate(word == 'left' and -0.2 or 0.2, 3.4, 0.45)
  eye:scale(0.06, 0.06, 0.06)
  root:add_child(eye)
end
gr.render(root, 'snowman.png', 96, 96, {0, 1.5, 9}, {0, 0, -1}, {0, 1, 0}, 45, {0.3, 0.3, 0.3},
          {gr.light({4, 8, 6}, {0.7, 0.7, 0.7}, {1, 0, 0})})
