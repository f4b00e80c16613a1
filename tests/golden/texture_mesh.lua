-- By vt: (0,0) is the picture's lower left. The left card shows it once, the right one twice across and one and a half times up.
dofile 'lib/stage.lua'
local function card(file, x)
    local node = gr.mesh('card', file)
    node:add_texture('pattern.png')
    return place(node, red, 0.9, 0, x, 0, 0)
end
show_at({0, 0, 4.5}, {card('card.obj', -0.95), card('card_repeat.obj', 0.95)}, {background = {0.1, 0.1, 0.1}}, 128, 80)
