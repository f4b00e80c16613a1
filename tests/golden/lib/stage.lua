-- The stage of the golden scenes: a floor, two lights (the white one from the upper right, in front), a camera in front
-- that looks a little down. show(node, ...) puts the nodes on it and renders.
matte = gr.material({0.8, 0.7, 0.5}, {0, 0, 0}, 1)
red = gr.material({0.8, 0.2, 0.2}, {0.4, 0.4, 0.4}, 20)
green = gr.material({0.2, 0.7, 0.3}, {0.4, 0.4, 0.4}, 20)
blue = gr.material({0.2, 0.3, 0.8}, {0.4, 0.4, 0.4}, 20)

-- A node with its material, scaled, turned about y and moved.
function place(node, material, scale, turn, x, y, z)
    if material then node:set_material(material) end
    node:scale(scale, scale, scale)
    node:rotate('y', turn)
    node:translate(x, y, z)
    return node
end

lights = {
    gr.light({5, 6, 6}, {0.8, 0.8, 0.8}, {1, 0, 0}),
    gr.light({-6, 3, 4}, {0.2, 0.2, 0.3}, {1, 0, 0}),
}

function floor()
    local node = gr.nh_box('floor', {-0.5, -1, -0.5}, 1)
    node:set_material(matte)
    node:scale(12, 0.2, 12)
    node:translate(0, -1, 0)
    return node
end

function show_at(eye, nodes, options, width, height)
    local root = gr.node('root')
    for _, node in ipairs(nodes) do root:add_child(node) end
    gr.render(root, 'golden.png', width or 96, height or 96, eye, {-eye[1], -eye[2], -eye[3]}, {0, 1, 0}, 36,
              {0.25, 0.25, 0.25}, lights, options)
end

function show(...) show_at({0.9, 1.8, 4.5}, {floor(), ...}) end
